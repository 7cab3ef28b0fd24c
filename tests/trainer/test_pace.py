"""Trainings by seconds on a busy machine, with a clock that goes by events: slow preparations, and slow steps."""

import dataclasses
from types import SimpleNamespace

import pytest
import torch

from mplicits.model.remarks import remarks
from mplicits.trainer import level, machine
from mplicits.trainer.networks.network import Weights
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training
from mplicits.trainer.training_samples import Pool, Sampler
from support.ball_training import QUICK, SMALL_SETTINGS, Log

SECONDS, STEP = 40.0, 0.2
SETTINGS = dataclasses.replace(SMALL_SETTINGS, seconds=SECONDS)
CONFIG = dataclasses.replace(
    QUICK,
    mining=dataclasses.replace(QUICK.mining, schedule=()),
    sampling=dataclasses.replace(QUICK.sampling, pool_per_second=50),
)


class Clock:
    """A clock that stands still but for steps, and for the pools that are drawn before them."""

    def __init__(self, patch: pytest.MonkeyPatch, *, preparation: float = 0.0, busy: float = 1.0) -> None:
        """preparation: seconds of a pool of the surface. busy: factor on the seconds of every step but each tenth."""
        self.now, self.steps, self._busy = 1000.0, 0, busy
        for name in ("train", "stage", "plan", "pace", "networks.fit"):
            patch.setattr(f"mplicits.trainer.{name}.time", SimpleNamespace(perf_counter=lambda: self.now))
        step, surface = level.LevelStep.__call__, Sampler.surface

        def slow_step(of: level.LevelStep, weights: Weights) -> float:
            self.steps += 1
            self.now += STEP * (self._busy if self.steps % 10 else 1.0)
            return step(of, weights)

        def slow_surface(of: Sampler, count: int) -> Pool:
            self.now += preparation
            return surface(of, count)

        patch.setattr(level.LevelStep, "__call__", slow_step)
        patch.setattr(Sampler, "surface", slow_surface)


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    machine.prepare(torch.device("cpu"))


@pytest.fixture(autouse=True)
def few_are_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mplicits.model.remarks.FEWEST_STEPS", 20)


def steps(training: Training) -> tuple[list[tuple[int, int]], list[str]]:
    """Train. Returns the steps of each level with those that its seconds hold, and the remarks."""
    provenance = training.run().provenance
    return [(record["steps"], record["steps_planned"]) for record in provenance["levels"]], remarks(provenance)


def test_an_idle_machine_takes_the_planned_steps(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    Clock(monkeypatch)
    (first, second), said = steps(Training(ball, SETTINGS, Log(), config=CONFIG))
    for taken, planned in (first, second):
        assert 0.8 * planned < taken <= planned
    assert sum(planned for _, planned in (first, second)) == pytest.approx(SECONDS / STEP, rel=0.01)
    assert not [line for line in said if "--seconds" in line], said


def test_a_slow_preparation_leaves_every_level_half_of_its_steps(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    reading = 2 * SECONDS
    clock = Clock(monkeypatch, preparation=SECONDS)
    began = clock.now
    training = Training(ball, SETTINGS, Log(), config=CONFIG)
    clock.now += reading
    for taken, planned in steps(training)[0]:
        assert 0.5 * planned <= taken < 0.6 * planned
    assert clock.now - began < reading + 2 * SECONDS + SECONDS, "reading, two pools, and at most the seconds themselves"


def test_slow_steps_are_told_with_the_seconds_that_they_need(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    Clock(monkeypatch, busy=10.0)
    ((_, _), (taken, planned)), said = steps(Training(ball, SETTINGS, Log(), config=CONFIG))
    assert planned == pytest.approx(0.75 * SECONDS / STEP, rel=0.01), "the fastest step is that of an idle machine"
    assert taken < planned / 5
    (line,) = [line for line in said if "--seconds" in line]
    assert line.startswith("level 1 took ")
    assert f", level 2 {taken:,} of some {planned:,}: the machine was busy, or --seconds 40 is too short" in line
    needed = float(line.partition("train again with --seconds ")[2].partition(",")[0])
    assert needed == pytest.approx(SECONDS * 9.1, rel=0.25)
