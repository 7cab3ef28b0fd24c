"""The time that a last look takes, and that it leaves."""

import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mplicits.trainer import last_look
from mplicits.trainer.last_look import Allowance, LastLook
from mplicits.trainer.networks.fit import Budget, Outcome
from mplicits.trainer.networks.network import Weights
from mplicits.trainer.pools import Pool, Sampler
from support.ball_training import Log
from support.looked_at import Level, finding


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
