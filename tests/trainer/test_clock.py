"""The clock of a training's schedule, which pauses do not move."""

from types import SimpleNamespace

import pytest
import torch

from mplicits.trainer.networks import fit
from mplicits.trainer.networks.network import Weights
from support.ball_training import Log


class Time:
    """Seconds that pass when a test says so."""

    now = 0.0

    def perf_counter(self) -> float:
        return self.now


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    time = Time()
    monkeypatch.setattr(fit, "time", SimpleNamespace(perf_counter=time.perf_counter))
    return time


def test_after_a_pause_the_rest_of_the_schedule_gets_the_time_that_is_left(time: Time) -> None:
    clock = fit.Budget(deadline=10.0, done=0.2).clock()
    assert clock(0) == pytest.approx(0.2)
    time.now = 5.0
    share = clock(100)
    assert share == pytest.approx(0.6)
    time.now = 8.0
    clock.go_on(share)
    assert clock(100) == pytest.approx(0.6)
    assert clock.left == pytest.approx(2.0)
    time.now = 9.0
    assert clock(200) == pytest.approx(0.8)
    time.now = 10.5
    assert clock(300) == 1.0


def test_a_pause_costs_no_steps_where_steps_count(time: Time) -> None:
    clock = fit.Budget(steps=100, done=0.5).clock()
    time.now = 1000.0
    assert clock(25) == pytest.approx(0.75)
    clock.go_on(0.75)
    assert clock(50) == 1.0
    assert clock.left == float("inf")


def test_a_schedule_is_gone_through_to_its_end_whatever_reviews_take(time: Time) -> None:
    shares: list[float] = []
    lefts: list[float] = []

    def step(weights: Weights) -> float:
        time.now += 0.01
        for w in weights:
            w.grad = torch.zeros_like(w)
        return 0.1

    def review(weights: Weights, share: float, left: float) -> None:
        shares.append(share)
        lefts.append(left)
        time.now += left / 4

    def start() -> Weights:
        return [torch.zeros(1, 3), torch.zeros(1), torch.zeros(1, 1), torch.zeros(1)]

    task = fit.Task(start, step, idle=1.0, rate=1e-3, output_factor=1.0, review=review)
    outcome = fit.fit(task, fit.Budget(deadline=60.0), Log())
    assert shares == pytest.approx(fit.REVIEWS, abs=0.01), "none comes late because of the one before"
    assert lefts[0] == pytest.approx(0.7 * 60, abs=0.1)
    assert 60 <= time.now < 60.1
    assert outcome.fraction == 1.0
