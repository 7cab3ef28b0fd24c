"""The last look of a training at the loose pieces of its surface."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

import mplicits
from mplicits.cli import perform
from mplicits.mesher import survey
from mplicits.model.model import Model
from mplicits.trainer import last_look
from mplicits.trainer.last_look import Pieces
from mplicits.trainer.networks.network import Weights
from mplicits.trainer.pools import Pool, Sampler
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training
from support.ball_training import QUICK_NUMBERS, SMALL_SETTINGS, Log
from support.looked_at import DELTA, SPOT, Level, finding


def test_a_level_without_loose_pieces_stays_as_it_is(level: Level) -> None:
    log = Log()
    assert level.look(finding(0), log) is level.start
    assert log.lines == ["loose pieces of surface: 0"]


def test_steps_are_taken_around_the_pieces(level: Level, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(last_look, "TRUE_ROUNDS", 2)
    log = Log()
    assert level.look(finding(2, 1, 0), log) is not level.start
    assert log.lines == ["loose pieces of surface: 2; 0 after 600 more steps around them"]
    hard = level.step.hard
    assert hard is not None
    assert hard.distance is not None
    assert len(hard.points) == 2 * last_look.POINTS, "those of the first round, too"
    assert float((hard.points - torch.tensor(SPOT)).norm(dim=1).max()) < 6 * last_look.SPREAD
    np.testing.assert_allclose(hard.distance, hard.points.norm(dim=1) - 1, atol=5e-3)


def test_what_was_hard_before_is_held_beside_them(level: Level, ball: Shape) -> None:
    sampler = Sampler(ball, [level.start], [DELTA], torch.device("cpu"), np.random.default_rng(0))
    before, distance = np.array([[0.0, 0.9, 0.0]]), np.array([-0.1])
    level.step.hard, level.step.hard_share = sampler.known(before.repeat(800, axis=0), distance.repeat(800)), 0.8
    level.look(finding(1, 0), Log())
    hard = level.step.hard
    held = (hard.points == torch.tensor(before, dtype=torch.float32)).all(dim=1)
    assert int(held.sum()) == 800
    assert len(held) == 900, "a tenth of a step's samples are around the pieces, as without"
    assert level.step.hard_share == pytest.approx(0.9)


def test_the_round_with_the_fewest_pieces_is_kept(level: Level, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(last_look, "ROUNDS", 3)
    log = Log()
    assert level.look(finding(2, 2, 4, 3), log) is level.start
    assert log.lines == ["loose pieces of surface: 2, which 900 more steps do not mend"]
    log = Log()
    level.look(finding(4, 5, 2, 3), log)
    assert log.lines == ["loose pieces of surface: 4; 2 after 600 more steps around them"]


@pytest.mark.parametrize(
    ("lost", "steps", "held"),
    [
        ((0, 2, 0), 600, True),  # A round closes two thin places, the next one opens them.
        ((2, 2), 300, False),  # They were wrong before.
        ((0, 2, 1, 1, 3, 2), 600, True),  # One stays closed.
    ],
)
def test_a_look_goes_on_until_thin_places_are_as_they_were(
    level: Level, monkeypatch: pytest.MonkeyPatch, lost: tuple[int, ...], steps: int, held: bool
) -> None:
    places, left = np.array([[0.0, 0.9, 0.0], [0.0, 0.0, 0.9]]), list(lost)

    def find_lost(self: Sampler, weights: Weights) -> Pool:
        count = left.pop(0)
        return self.known(places[:count], np.full(count, -0.1))

    monkeypatch.setattr(Sampler, "lost", find_lost)
    log = Log()
    level.look(finding(1, *[0] * (len(lost) - 1)), log)
    assert not left
    assert log.lines == [f"loose pieces of surface: 1; 0 after {steps} more steps around them"]
    hard = level.step.hard
    assert hard is not None
    at_places = torch.cdist(hard.points, torch.tensor(places, dtype=torch.float32)).min(dim=1).values < 1e-6
    assert int(at_places.sum()) == (last_look.POINTS // 2 if held else 0)


def trained(ball: Shape, monkeypatch: pytest.MonkeyPatch, find: Callable[[Model], Pieces], log: Log) -> Training:
    for module, name, number in (*QUICK_NUMBERS, (last_look, "STEPS", 5), (last_look, "LEAST_STEPS", 100)):
        monkeypatch.setattr(module, name, number)
    training = Training(ball, replace(SMALL_SETTINGS, steps=(150, 150, 0)), log, find=find)
    training.run()
    return training


def test_a_training_looks_at_its_last_level_and_says_so(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    counts, seen = [1, 0], []

    def find(model: Model) -> Pieces:
        seen.append(len(model.levels))
        return counts.pop(0), SPOT.astype(np.float32), np.ones(1, np.int64)

    log = Log()
    assert not trained(ball, monkeypatch, find, log).interrupted
    assert seen == [2, 2]
    assert "loose pieces of surface: 1; 0 after 5 more steps around them" in log.lines


def test_ctrl_c_in_the_look_keeps_the_level(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    def find(model: Model) -> Pieces:
        raise KeyboardInterrupt

    training = trained(ball, monkeypatch, find, Log())
    assert training.interrupted
    assert len(training._trained.levels) == 2


@pytest.mark.parametrize("way", ["command", "function"])
def test_the_front_doors_look(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str) -> None:
    for module, name, number in (*QUICK_NUMBERS, (last_look, "LEAST_STEPS", 20)):
        monkeypatch.setattr(module, name, number)
    looked = []

    def find(model: Model) -> Pieces:
        looked.append(len(model.levels))
        return 0, np.empty((0, 3), np.float32), np.empty(0, np.int64)

    monkeypatch.setattr(survey, "loose_pieces", find)
    trimesh.creation.icosphere(subdivisions=3).export(tmp_path / "ball.ply")
    monkeypatch.chdir(tmp_path)
    if way == "command":
        perform(["train", "ball.ply", "--levels", "8x1,8x1", "--steps", "60,40", "--omega", "8,16", "--quiet"])
    else:
        mplicits.train("ball.ply", "8x1,8x1", steps="60,40", omega="8,16", quiet=True)
    assert looked == [2]


def test_later_rounds_teach_a_place_without_the_piece(level: Level) -> None:
    """What the network cannot have is filled, or opened, by what is around it, where it is as thin as here."""
    sides, spot = iter([1, 1, -1]), np.array([[1.001, 0.0, 0.0]], np.float32)

    def find(weights: Weights) -> Pieces:
        side = next(sides, 0)
        return abs(side), spot, np.full(1, side)

    level.look(find, Log())
    hard = level.step.hard
    assert hard is not None
    assert hard.distance is not None
    assert len(hard.points) == 2 * last_look.POINTS, "those of the second and of the third round"
    outside, inside = hard.distance[: last_look.POINTS], hard.distance[last_look.POINTS :]
    assert float(outside.min()) >= last_look.WITHOUT
    assert float(inside.max()) <= -last_look.WITHOUT


def test_they_do_so_where_a_piece_comes_back(level: Level, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second round has no piece, and mends a thin place; the shape's own distances go in the third."""
    spot, count, lost = np.array([[1.001, 0.0, 0.0]], np.float32), iter([1, 0, 1, 0]), iter([0, 1, 0, 0])

    def find(weights: Weights) -> Pieces:
        return next(count), spot, np.ones(1, np.int64)

    def find_lost(self: Sampler, weights: Weights) -> Pool:
        places = np.zeros((next(lost), 3))
        return self.known(places, np.full(len(places), -1.0))

    monkeypatch.setattr(Sampler, "lost", find_lost)
    level.look(find, Log())
    hard = level.step.hard
    assert hard is not None
    assert hard.distance is not None
    assert float(hard.distance[: last_look.POINTS].min()) >= last_look.WITHOUT
    assert len(hard.points) == 3 * last_look.POINTS // 2


def test_what_may_be_the_shapes_own_is_not_taken_away(level: Level) -> None:
    """A small piece that the shape's distances make 2 thick, as deep as the ball is."""
    pole = np.array([[0.0, 0.0, 0.9], [0.0, 0.0, -0.9]], np.float32)
    log, found = Log(), []

    def find(weights: Weights) -> Pieces:
        found.append(1)
        return 1, pole, np.ones(2, np.int64)

    assert level.look(find, log) is level.start
    assert len(found) == 1 + last_look.ROUNDS
    assert log.lines == [f"loose pieces of surface: 1, which {last_look.ROUNDS * 300} more steps do not mend"]
