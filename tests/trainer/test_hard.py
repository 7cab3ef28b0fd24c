"""Hard points: where a residual makes surface, or nearly, and where level 1 exceeds the distance."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from mplicits.trainer import pools
from mplicits.trainer.before import FIRST_BAND, REACH
from mplicits.trainer.hard import EXCESS, LEAST_DISTANCE, WRONG_SIGN
from mplicits.trainer.level import HARD_SHARE, LevelStep
from mplicits.trainer.networks import fit, losses
from mplicits.trainer.networks.network import Weights, initial, value
from mplicits.trainer.settings import RESIDUAL
from mplicits.trainer.shapes.shape import Shape
from support.ball_training import QUICK_NUMBERS, SMALL_SETTINGS, Log, load_ball, train

DELTA, NEAR = 0.05, 0.008
CPU = torch.device("cpu")


def constant(number: float) -> Weights:
    """A network whose value is `number` everywhere."""
    return [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.full((1,), number)]


def sampler(ball: Shape, before: float) -> pools.Sampler:
    """A sampler of level 2, where f_1 is constant."""
    return pools.Sampler(ball, [constant(before)], [DELTA], CPU, np.random.default_rng(0))


def test_points_off_the_surface_where_the_field_vanishes_are_hard(ball: Shape) -> None:
    hard = sampler(ball, 0.0).hard(constant(0.0), None, 2000, NEAR)
    assert hard is not None
    assert hard.distance is not None
    away = hard.points.norm(dim=1) - 1
    assert float(away.abs().min()) > LEAST_DISTANCE * DELTA - 5e-3
    reach = REACH * DELTA
    np.testing.assert_allclose(hard.distance, away.clamp(-reach, reach), atol=5e-3)
    np.testing.assert_array_equal(hard.frozen, 0)
    again = sampler(ball, 0.0).hard(constant(0.0), hard, 2000, NEAR)
    assert again is not None
    assert len(again.points) > len(hard.points), "more are searched for around those that are known"


@pytest.mark.parametrize(("before", "residual"), [(0.04, 0.0), (0.04, -0.02), (2 * DELTA, 0.0)])
def test_a_residual_that_neither_vanishes_nor_adds_has_no_hard_points(
    ball: Shape, before: float, residual: float
) -> None:
    """The last case has no band at all."""
    assert sampler(ball, before).hard(constant(residual), None, 2000, NEAR) is None


def test_points_that_a_residual_puts_too_far_away_are_hard(ball: Shape) -> None:
    """Of f = 0.04 where f_1 was 0, those between NEAR and 0.04 / EXCESS from the surface."""
    hard = sampler(ball, 0.0).hard(constant(0.04), None, 20_000, NEAR)
    assert hard is not None
    assert hard.distance is not None
    outside = hard.distance[(hard.distance > 0) & (hard.distance < DELTA)]  # farther away, f lacks size
    assert NEAR <= float(outside.min()) < NEAR + 2e-3
    assert 0.04 / EXCESS - 2e-3 < float(outside.max()) < 0.04 / EXCESS


def test_points_with_the_wrong_sign_are_hard_close_to_the_surface_of_a_mesh(
    ball: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of f = -0.0001, those just outside; of a cloud, whose distances are not exact there, only those farther away."""
    nearest = []
    for cloud in (False, True):
        monkeypatch.setattr(ball, "cloud", cloud)
        hard = sampler(ball, 0.0).hard(constant(-1e-4), None, 20_000, NEAR)
        assert hard is not None
        assert hard.distance is not None
        nearest.append(float(hard.distance[hard.distance > 0].min()))
        assert float(hard.distance[hard.distance < 0].max()) < -LEAST_DISTANCE * DELTA
    assert WRONG_SIGN < nearest[0] < WRONG_SIGN + 1e-3
    assert nearest[1] > LEAST_DISTANCE * DELTA


def test_a_shape_that_was_noisy_has_no_such_points(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ball, "noise", 0.01)
    assert sampler(ball, 0.0).hard(constant(0.04), None, 20_000, NEAR) is None


def test_points_that_level_1_puts_too_far_away_are_hard(ball: Shape) -> None:
    """Of a field that is 0.03 everywhere, those between NEAR and 0.03 / EXCESS from the surface."""
    first = pools.Sampler(ball, [], [], CPU, np.random.default_rng(0))
    hard = first.hard(constant(0.03), None, 10_000, NEAR)
    assert hard is not None
    assert hard.distance is not None
    away = hard.points.norm(dim=1) - 1
    assert NEAR - 5e-3 < float(away.abs().min()) < NEAR + 5e-3
    assert 0.025 < float(away.abs().max()) < 0.03 / EXCESS + 5e-3
    np.testing.assert_allclose(hard.distance, away, atol=5e-3)
    again = first.hard(constant(0.03), hard, 10_000, NEAR)
    assert again is not None
    assert len(again.points) > len(hard.points), "more are searched for around those that are known"
    assert first.hard(constant(0.0), None, 10_000, NEAR) is None, "a field that falls short everywhere has none"


@pytest.mark.parametrize(("weights", "levels"), [({}, {0, 1}), ({"excess": 1.0}, {1})])
def test_level_1_has_hard_points_where_exceeding_the_distance_weighs_more(
    ball: Shape, monkeypatch: pytest.MonkeyPatch, weights: dict[str, float], levels: set[int]
) -> None:
    searched = set()
    search = pools.Sampler.hard

    def counted(
        self: pools.Sampler, level: Weights, known: pools.Pool | None, count: int, near: float
    ) -> pools.Pool | None:
        searched.add(len(self._before.levels))
        return search(self, level, known, count, near)

    monkeypatch.setattr(pools.Sampler, "hard", counted)
    for module, name, number in QUICK_NUMBERS:
        monkeypatch.setattr(module, name, number)
    train(ball, replace(SMALL_SETTINGS, weights=weights))
    assert searched == levels


def pool(count: int, seed: int) -> pools.Pool:
    """Random samples, all of which are at a distance of 0.1."""
    generator = torch.Generator().manual_seed(seed)
    points = torch.rand(count, 3, generator=generator) * 2 - 1
    normals = torch.nn.functional.normalize(points, dim=1)
    return pools.Pool(points, torch.full((count,), 0.1), normals, torch.zeros(count), torch.zeros(count, 3))


def test_a_step_also_takes_the_gradient_of_hard_points_and_its_loss_does_not_count_them() -> None:
    surface, volume, hard = pool(400, 1), pool(400, 2), pool(1, 3)
    start = initial((8, 1), 5.0, 1, torch.Generator().manual_seed(0))
    gradients, loss = [], []
    for more in (None, hard):
        weights = [w.clone().requires_grad_() for w in start]
        for w in weights:
            w.grad = torch.zeros_like(w)
        step = LevelStep(surface, volume, RESIDUAL, torch.Generator().manual_seed(4))
        step.hard = more
        loss.append(step(weights))
        gradients.append([w.grad for w in weights])
    assert loss[0] == loss[1]
    weights = [w.clone().requires_grad_() for w in start]
    term, _ = losses.distance(
        value(weights, hard.points)[:, 0], torch.tensor([0.1]), RESIDUAL.excess, RESIDUAL.lacking, RESIDUAL.near
    )
    count = int(400 * HARD_SHARE)
    expected = torch.autograd.grad(RESIDUAL.distance * term * count / 400, weights)
    for without, with_hard, derivative in zip(*gradients, expected, strict=True):
        assert without is not None
        assert with_hard is not None
        torch.testing.assert_close(with_hard - without, derivative, rtol=2e-3, atol=2e-3)


def test_a_network_is_reviewed_at_its_shares_of_the_schedule() -> None:
    seen: list[int] = []
    shares: list[float] = []
    steps = 0

    def step(weights: Weights) -> float:
        nonlocal steps
        steps += 1
        return 0.1

    def start() -> Weights:
        return constant(0.0)

    def review(weights: Weights, share: float, left: float) -> None:
        assert left == np.inf
        seen.append(steps)
        shares.append(share)

    task = fit.Task(start, step, idle=1.0, rate=1e-3, output_factor=1.0, review=review)
    fit.fit(task, fit.Budget(steps=100), Log())
    assert seen == [round(share * 100) for share in fit.REVIEWS]
    assert tuple(shares) == pytest.approx(fit.REVIEWS, abs=0.011)
    seen.clear()
    steps = 0
    fit.fit(task, fit.Budget(steps=100, done=0.8), Log())
    assert len(seen) == 2, "shares that are done already are not reviewed again"


def test_level_1_sees_the_ball_and_a_little_of_the_corners(tmp_path: Path) -> None:
    first = pools.Sampler(load_ball(tmp_path), [], [], CPU, np.random.default_rng(0))
    radii = first.volume(10_000).points.norm(dim=1)
    corners = (radii > 1 + np.sqrt(3) * FIRST_BAND).double().mean()
    assert 0.02 < corners < pools.CORNER_SHARE + 0.01
    assert float((radii < 0.5).double().mean()) > 0.5**3 * 0.5, "the inside, too, by its volume"
