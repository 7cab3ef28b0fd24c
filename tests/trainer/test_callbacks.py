"""Callbacks of a level's training, and the clock of its schedule, which pauses for them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from PIL import Image

from mplicits.api.pictures import pictures
from mplicits.trainer import callbacks
from mplicits.trainer.callbacks import (
    FollowSurfaceEikonal,
    MineHardExamples,
    RaiseLateValue,
    ShowLevels,
    followed_length,
    share_near_one,
    surface_goal,
)
from mplicits.trainer.config import LossConfig, SurfaceEikonalConfig
from mplicits.trainer.level import LevelState, LevelStep
from mplicits.trainer.mining import Miner
from mplicits.trainer.mining_config import MiningConfig
from mplicits.trainer.networks import fit, losses
from mplicits.trainer.networks.callback import Callback, FitState
from mplicits.trainer.networks.network import Weights, initial, value
from mplicits.trainer.networks.snapshot import Snapshot
from mplicits.trainer.shapes.cloud import CloudShape
from mplicits.trainer.shapes.shape import Shape, SurfacePoints, unit
from mplicits.trainer.train import Training
from mplicits.trainer.training_samples import Pool, Sampler
from support.ball_training import QUICK, SMALL_SETTINGS, Log, constant, frozen_level, rng, train

LOSS, MINING, EIKONAL = LossConfig(), MiningConfig(), SurfaceEikonalConfig()
RESIDUAL = LOSS.residual
ALWAYS = tuple(k / 100 for k in range(1, 101))
"""A schedule that every share of two decimals reaches."""


def state(weights: Weights, share: float, left: float = np.inf) -> FitState:
    return FitState(weights, 1, share, share - 0.01, 0.0, left, Snapshot)


def level_step(ball: Shape) -> tuple[LevelStep, Sampler, Miner]:
    frozen, generator = frozen_level(0.05), rng()
    sampler, miner = Sampler(ball, frozen, generator), Miner(ball, frozen, generator)
    step = LevelStep(sampler.surface(2048), sampler.volume(2048), RESIDUAL, torch.Generator().manual_seed(0))
    return step, sampler, miner


def taken(step: LevelStep, weights: Weights) -> tuple[float, list[torch.Tensor]]:
    """Take a step. Returns its loss and the gradients of the weights."""
    copies = [w.clone().requires_grad_() for w in weights]
    for w in copies:
        w.grad = torch.zeros_like(w)
    loss = step(copies)
    return loss, [w.grad for w in copies if w.grad is not None]


def small_network() -> Weights:
    return initial((8, 1), 5.0, 1, torch.Generator().manual_seed(0))


def surface(lengths: list[float]) -> Pool:
    """Return points of a surface at which |grad f_1| has these lengths."""
    count = len(lengths)
    gradient = torch.tensor(lengths)[:, None] * torch.tensor([0.6, 0.0, 0.8])
    return Pool(torch.zeros(count, 3), torch.zeros(count), gradient, torch.zeros(count), gradient)


def test_the_share_near_one_is_that_of_the_whole_gradient() -> None:
    lengths = [0.5, 0.79, 0.81, 1.0, 1.19, 1.21, 3.0, 0.0]
    assert share_near_one(constant(0.0), surface(lengths), EIKONAL) == 3 / 8
    weights = small_network()
    points = torch.rand(500, 3, generator=torch.Generator().manual_seed(1)).requires_grad_()
    (own,) = torch.autograd.grad(value(weights, points).sum(), points)
    pool = replace(surface([1.0] * 500), points=points.detach())
    length = (own + pool.frozen_gradient).norm(dim=1)
    share = float(((length > EIKONAL.shortest) & (length < EIKONAL.longest)).float().mean())
    assert 0 < share < 1
    assert share_near_one(weights, pool, EIKONAL) == pytest.approx(share, abs=0.005)


@pytest.mark.parametrize("length", [1.0, 15.0])
def test_the_eikonal_weight_rises_where_the_share_is_small_and_falls_back(length: float) -> None:
    goal = surface_goal(0.01, EIKONAL)

    def follow(present: float, share: float) -> float:
        return followed_length(present, share, goal, length, EIKONAL)

    risen = follow(length, 0.7)
    assert length < risen <= EIKONAL.largest_factor * length
    assert follow(length, 0.8) < risen
    assert follow(risen, goal) == pytest.approx(risen)
    assert length <= follow(risen, 0.99) < risen
    assert follow(length, 1.0) == length
    assert follow(EIKONAL.largest, 0.7) == EIKONAL.largest
    assert follow(40.0, 0.3) == 40.0, "the surface is not learnt yet"


def test_later_steps_have_the_followed_eikonal_weight(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(callbacks, "share_near_one", lambda *_: 0.7)
    step, sampler, _ = level_step(ball)
    before, _ = taken(level_step(ball)[0], small_network())
    FollowSurfaceEikonal(step, sampler.surface(100), 0.0, ALWAYS, EIKONAL).before_step(state(small_network(), 0.9))
    assert step.weight == replace(RESIDUAL, length=step.weight.length)
    assert step.weight.length > RESIDUAL.length
    assert taken(step, small_network())[0] > before


def test_late_values_have_a_larger_weight_and_the_loss_stays_comparable(ball: Shape) -> None:
    step, sampler, miner = level_step(ball)
    weights, late = small_network(), RaiseLateValue(step, ALWAYS, LOSS)
    late.before_step(state(weights, LOSS.late - 0.1))
    early_loss, early = taken(step, weights)
    step, sampler, miner = level_step(ball)
    late = RaiseLateValue(step, ALWAYS, LOSS)
    late.before_step(state(weights, LOSS.late))
    late_loss, large = taken(step, weights)
    assert step.weight.value == LOSS.late_value * RESIDUAL.value
    assert torch.cat([g.ravel() for g in large]).norm() > 5 * torch.cat([g.ravel() for g in early]).norm()
    assert late_loss == pytest.approx(early_loss, rel=1e-4)
    again = level_step(ball)[0]
    LevelState(again, sampler, miner).restore(LevelState(step, sampler, miner).snapshot())
    assert again.weight == step.weight
    late.before_step(state(weights, 0.3))
    assert step.weight == RESIDUAL, "a restart begins as the level did"
    assert LOSS.late in MINING.schedule


def test_mining_that_would_take_too_much_of_the_remaining_time_is_skipped(
    ball: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    step, sampler, miner = level_step(ball)
    mined: list[int] = []
    monkeypatch.setattr(miner, "mine", lambda *_: mined.append(1))
    mining = MineHardExamples(step, miner, sampler, 2000, 0.1, replace(MINING, schedule=ALWAYS))
    mining.before_step(state(constant(0.0), 0.3, 1.0))
    assert len(mined) == 1, "the time of the first mining is unknown"
    mining._seconds = 2.0
    mining.before_step(state(constant(0.0), 0.5, 1.9 / MINING.longest))
    assert len(mined) == 1
    mining.before_step(state(constant(0.0), 0.5, 2.1 / MINING.longest))
    assert len(mined) == 2


@pytest.mark.parametrize(
    ("share", "steps", "left", "mined"),
    [(0.85, 800, np.inf, True), (0.7, 800, np.inf, False), (0.85, 799, np.inf, False), (0.85, 800, 5.0, False)],
)
def test_loose_components_are_mined_late_in_a_long_schedule(
    ball: Shape, share: float, steps: int, left: float, mined: bool
) -> None:
    """The search of 2 s takes too much of 5 s."""
    step, sampler, miner = level_step(ball)
    spot = np.array([[0.0, 1.1, 0.0]])
    mining = MineHardExamples(step, miner, sampler, 2000, 0.1, MINING, lambda _: spot, 2.0)
    mining.before_step(replace(state(constant(0.0), share, left), steps=steps))
    assert step.hard is not None
    near = (step.hard.points - torch.tensor(spot, dtype=torch.float32)).norm(dim=1) < 0.02
    assert (int(near.sum()) > 0.3 * len(near)) == mined
    assert (step.hard_share > 0.15) == mined


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("cloud", "weights", "followed", "values"),
    [
        (True, {}, 5, {1e4, 3e5}),
        (True, {"length": 2.0}, 0, {1e4, 3e5}),
        (False, {}, 0, {1e4, 3e5, 3e6}),
        (False, {"value": 5000.0}, 0, {5000.0}),
    ],
)
def test_loss_weights_adapt_by_the_kind_of_shape_unless_the_user_sets_them(
    ball: Shape,
    monkeypatch: pytest.MonkeyPatch,
    cloud: bool,
    weights: dict[str, float],
    followed: int,
    values: set[float],
) -> None:
    points = unit(rng().normal(size=(4000, 3)))
    shape: Shape = CloudShape(SurfacePoints(points, points), "cloud", {}) if cloud else ball
    measured, seen, call = list[int](), set[float](), LevelStep.__call__

    def counted(weights: Weights, pool: Pool, config: object) -> float:
        measured.append(len(pool.points))
        return 1.0

    def watched(step: LevelStep, weights: Weights) -> float:
        seen.add(step.weight.value)
        return call(step, weights)

    monkeypatch.setattr(callbacks, "share_near_one", counted)
    monkeypatch.setattr(LevelStep, "__call__", watched)
    train(shape, replace(SMALL_SETTINGS, steps=(60, 60, 0), weights=weights, texture=False))
    assert (len(measured), seen) == (followed, values)


def random_pool(count: int, seed: int) -> Pool:
    """Return random samples at a distance of 0.1."""
    points = torch.rand(count, 3, generator=torch.Generator().manual_seed(seed)) * 2 - 1
    normals = torch.nn.functional.normalize(points, dim=1)
    return Pool(points, torch.full((count,), 0.1), normals, torch.zeros(count), torch.zeros(count, 3))


def test_a_step_adds_the_gradient_of_hard_points_and_returns_the_loss_without_them() -> None:
    on, around, hard = random_pool(400, 1), random_pool(400, 2), random_pool(1, 3)
    results = []
    for more in (None, hard):
        step = LevelStep(on, around, RESIDUAL, torch.Generator().manual_seed(4))
        step.hard = more
        results.append(taken(step, small_network()))
    (loss, without), (same_loss, with_hard) = results
    assert loss == same_loss
    weights = [w.clone().requires_grad_() for w in small_network()]
    term, _ = losses.distance(
        value(weights, hard.points)[:, 0], torch.tensor([0.1]), RESIDUAL.excess, RESIDUAL.lacking, RESIDUAL.near
    )
    count = int(400 * MINING.share)
    expected = torch.autograd.grad(RESIDUAL.distance * term * count / 400, weights)
    for one, two, derivative in zip(without, with_hard, expected, strict=True):
        torch.testing.assert_close(two - one, derivative, rtol=2e-3, atol=2e-3)


def test_hard_examples_with_a_time_resume() -> None:
    """Samples of a shape that moves have a fourth coordinate."""
    times = torch.linspace(0, 1, 400)[:, None]
    on, around = (random_pool(400, seed) for seed in (1, 2))
    on, around = (
        replace(pool, points=torch.cat((pool.points, times), 1), frozen_gradient=torch.zeros(400, 4))
        for pool in (on, around)
    )
    step, again = (LevelStep(on, around, RESIDUAL, torch.Generator().manual_seed(4)) for _ in range(2))
    step.hard = around.take(slice(0, 30))
    sampler = SimpleNamespace(
        pool=lambda points, distance: replace(
            around, points=torch.from_numpy(points).float(), distance=torch.from_numpy(distance).float()
        )
    )
    again.restore(step.snapshot(), sampler)  # type: ignore[arg-type]
    assert again.hard is not None
    torch.testing.assert_close(again.hard.points, step.hard.points)
    torch.testing.assert_close(again.hard.distance, step.hard.distance)


class Time:
    """A clock that a test sets."""

    now = 0.0

    def perf_counter(self) -> float:
        return self.now


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> Time:
    time = Time()
    monkeypatch.setattr(fit, "time", SimpleNamespace(perf_counter=time.perf_counter))
    return time


def test_a_pause_costs_no_steps_where_steps_count(time: Time) -> None:
    clock = fit.Budget(steps=100, done=0.5).clock()
    time.now = 1000.0
    assert clock(25) == pytest.approx(0.75)
    clock.resume_at(0.75)
    assert clock(50) == 1.0
    assert clock.left == float("inf")


class Recorder(Callback):
    """Records the states at the mining's schedule."""

    def __init__(self, pause: Callable[[FitState], None] = lambda state: None) -> None:
        self.states: list[FitState] = []
        self._pause = pause

    def before_step(self, state: FitState) -> None:
        if state.reaches(MINING.schedule):
            self.states.append(state)
            self._pause(state)


def fitted(recorder: Recorder, budget: fit.Budget, step: fit.Step = lambda weights: 0.1) -> fit.Outcome:
    task = fit.Task(lambda: constant(0.0), step, idle=1.0, rate=1e-3, output_factor=1.0)
    return fit.fit(task, budget, print, [recorder])


def test_callbacks_run_at_their_shares_of_the_schedule() -> None:
    recorder = Recorder()
    fitted(recorder, fit.Budget(steps=100))
    assert [state.steps for state in recorder.states] == [round(share * 100) for share in MINING.schedule]
    assert [state.share for state in recorder.states] == pytest.approx(MINING.schedule, abs=0.011)
    recorder = Recorder()
    fitted(recorder, fit.Budget(steps=100, done=0.8))
    assert len(recorder.states) == 2, "not again at shares of the interrupted run"


def test_pauses_delay_no_later_callback_and_end_with_the_schedule(time: Time) -> None:
    def step(weights: Weights) -> float:
        time.now += 0.01
        for w in weights:
            w.grad = torch.zeros_like(w)
        return 0.1

    def pause(state: FitState) -> None:
        time.now += state.seconds_left / 4

    recorder = Recorder(pause)
    outcome = fitted(recorder, fit.Budget(deadline=60.0), step)
    assert [state.share for state in recorder.states] == pytest.approx(MINING.schedule, abs=0.01)
    assert recorder.states[0].seconds_left == pytest.approx(0.7 * 60, abs=0.1)
    assert 60 <= time.now < 60.1
    assert outcome.fraction == 1.0


@pytest.mark.slow
def test_a_preview_that_fails_costs_no_training(ball: Shape, tmp_path: Path) -> None:
    """The user's own picture stays, and the training goes on."""
    log, draw = Log(), pictures(tmp_path)
    photograph = tmp_path / "ball-1.png"
    Image.new("RGB", (3, 3)).save(photograph)
    before = photograph.read_bytes()
    settings = replace(SMALL_SETTINGS, steps=(20, 20, 20))
    model = Training(ball, settings, log, callbacks=[ShowLevels(draw, log.say)], config=QUICK).run()
    assert len(model.levels) == 2
    assert photograph.read_bytes() == before
    assert (tmp_path / "ball-2.png").exists()
    (line,) = (line for line in log.lines if line.startswith("warning"))
    assert "is not a picture that mplicits wrote; move it away" in line
