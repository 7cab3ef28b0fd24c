"""The last look of a training at the loose pieces of its surface."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

import mplicits
from mplicits.cli import perform
from mplicits.mesher import survey
from mplicits.model.model import Model
from mplicits.trainer import last_look
from mplicits.trainer.last_look import Allowance, LastLook, Pieces
from mplicits.trainer.level import LevelStep
from mplicits.trainer.networks.fit import Budget, Outcome, Task
from mplicits.trainer.networks.network import Weights, initial
from mplicits.trainer.pools import Pool, Sampler
from mplicits.trainer.settings import RESIDUAL
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training
from support.ball_training import QUICK_NUMBERS, SMALL_SETTINGS, Log, load_ball

DELTA = 0.05
SPOT = np.array([[1.02, 0.0, 0.0]])
"""A point outside of the ball."""


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    return load_ball(tmp_path_factory.mktemp("ball"))


@dataclass
class Level:
    """A level that `last_look` is to look at."""

    start: Weights
    shape: Shape
    sampler: Sampler
    step: LevelStep
    task: Task
    look: Callable[..., Weights]


@pytest.fixture
def level(ball: Shape) -> Level:
    """Level 2 of a ball, f_1 = 0."""
    nothing = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.zeros(1)]
    sampler = Sampler(ball, [nothing], [DELTA], torch.device("cpu"), np.random.default_rng(0))
    start = initial((8, 1), 5.0, 1, torch.Generator().manual_seed(0), 0.01)
    step = LevelStep(sampler.surface(512), sampler.volume(512), RESIDUAL, torch.Generator().manual_seed(0))
    task = Task(lambda: start, step, idle=1.0, rate=0.02, output_factor=0.1)
    look = partial(last_look.last_look, "level 2, loose pieces (8x1)", start, task, step, sampler, ball)
    return Level(start, ball, sampler, step, task, look)


def finding(*counts: int) -> Callable[[Weights], Pieces]:
    """Find so many pieces, in turn, all at `SPOT`."""
    left = list(counts)

    def find(weights: Weights) -> Pieces:
        count = left.pop(0)
        return count, np.repeat(SPOT, count, axis=0).astype(np.float32), np.arange(1, count + 1)

    return find


def test_a_level_without_loose_pieces_stays_as_it_is(level: Level) -> None:
    log = Log()
    assert level.look(finding(0), log) is level.start
    assert log.lines == ["loose pieces of surface: 0"]


@pytest.mark.parametrize(
    ("pieces", "lost", "line"),
    [
        (0, [3, 3], "loose pieces of surface: 0; 400 more steps in the time left"),
        (1, [], "loose pieces of surface: 0"),
        (0, [4, 3], "loose pieces of surface: 0"),
    ],
)
def test_seconds_that_are_left_are_used(
    level: Level, monkeypatch: pytest.MonkeyPatch, pieces: int, lost: list[int], line: str
) -> None:
    """But not where that makes a piece, or gets a thin place wrong that was right: 4 after it, 3 before."""
    clock = iter([0.0, 2.0, 2.0])  # The search, from 0 to 2, then what is left.
    monkeypatch.setattr(last_look, "time", SimpleNamespace(perf_counter=lambda: next(clock)))

    def find_lost(self: Sampler, weights: Weights) -> Pool:
        places = np.zeros((lost.pop(0), 3))
        return self.known(places, np.full(len(places), -1.0))

    monkeypatch.setattr(Sampler, "lost", find_lost)
    log = Log()
    seen = level.look(finding(0, pieces), log, Allowance(24.0, 0.05))
    assert (seen is level.start) == (not line.endswith("left"))
    assert log.lines == [line]
    assert not lost


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


def test_no_round_begins_that_does_not_fit(level: Level) -> None:
    log = Log()
    assert level.look(finding(2), log, Allowance(time.perf_counter() + 10, 1.0)) is level.start
    assert log.lines == ["loose pieces of surface: 2; no time is left to train on around them"]


def test_a_round_is_as_long_as_fits(level: Level, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 2.0, 2.0, 10.0])  # The search, from 0 to 2, then what is left before the two rounds.
    monkeypatch.setattr(last_look, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    log = Log()
    level.look(finding(2, 1), log, Allowance(14.0, 0.05))
    assert log.lines == ["loose pieces of surface: 2; 1 after 200 more steps around them"]


def test_a_look_takes_a_share_of_the_seconds_or_none() -> None:
    three = last_look.SEARCH + 3 * last_look.ROUND
    assert last_look.seconds_kept(0.1, 100.0) == pytest.approx(0.1 * three)
    assert last_look.seconds_kept(1.0, 100.0) == pytest.approx(30.0)
    assert last_look.seconds_kept(30 / last_look.SEARCH, 100.0) == 0


@pytest.mark.parametrize("done", [0.0, 0.75])
def test_a_level_knows_what_its_steps_take(level: Level, monkeypatch: pytest.MonkeyPatch, done: float) -> None:
    """A level of 100 s that is measured in 1 s: 29.7 s are kept; a training that goes on has steps of before."""
    now, seen = [0.0], list[Allowance]()
    monkeypatch.setattr(last_look, "time", SimpleNamespace(perf_counter=lambda: now[0]))

    def looked(*arguments: Any) -> Weights:
        seen.append(arguments[-1])
        return level.start

    monkeypatch.setattr(last_look, "last_look", looked)
    look = LastLook(finding(), level.shape, Log())
    budget = look.leave(Budget(deadline=100.0, done=done), lambda: 1.0)
    assert budget.deadline == pytest.approx(99 - 29.7)
    now[0] = 60.0
    outcome = Outcome(level.start, 4000, 1.0, 0, 0.02, 0.1, interrupted=False, failed=False)
    look("level 2", outcome, level.task, level.step, level.sampler)
    (allowance,) = seen
    assert allowance.end == 99
    assert allowance.step == pytest.approx(60 / (4000 * (1 - done)))


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
