"""Reviews of a level that is being trained, which change the weights of its loss."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from mplicits.trainer import review
from mplicits.trainer.level import LevelDraws, LevelStep
from mplicits.trainer.networks import fit
from mplicits.trainer.networks.network import Weights, initial, value
from mplicits.trainer.pools import Pool, Sampler
from mplicits.trainer.settings import LATE, LATE_VALUE, RESIDUAL
from mplicits.trainer.shapes.cloud import CloudShape
from mplicits.trainer.shapes.shape import Shape, SurfacePoints, unit
from support.ball_training import QUICK_NUMBERS, SMALL_SETTINGS, load_ball, train

FLAT: Weights = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.zeros(1)]
"""A network that is zero everywhere."""


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    for module, name, number in QUICK_NUMBERS:
        monkeypatch.setattr(module, name, number)


def surface(lengths: list[float]) -> Pool:
    """Points of a surface on which |grad f_1| is so long."""
    count = len(lengths)
    gradient = torch.tensor(lengths)[:, None] * torch.tensor([0.6, 0.0, 0.8])
    return Pool(torch.zeros(count, 3), torch.zeros(count), gradient, torch.zeros(count), gradient)


def test_the_share_within_the_bounds_is_that_of_the_whole_gradient() -> None:
    lengths = [0.5, 0.79, 0.81, 1.0, 1.19, 1.21, 3.0, 0.0]
    assert review.within(FLAT, surface(lengths)) == 3 / 8
    weights = initial((8, 1), 5.0, 1, torch.Generator().manual_seed(0))
    points = torch.rand(500, 3, generator=torch.Generator().manual_seed(1)).requires_grad_()
    (own,) = torch.autograd.grad(value(weights, points).sum(), points)
    pool = replace(surface([1.0] * 500), points=points.detach())
    length = (own + pool.frozen_gradient).norm(dim=1)
    share = float(((length > review.LOW) & (length < review.HIGH)).float().mean())
    assert 0 < share < 1
    assert review.within(weights, pool) == pytest.approx(share, abs=0.005)


@pytest.mark.parametrize("length", [1.0, 15.0])
def test_the_weight_rises_where_the_share_is_small_and_falls_back(length: float) -> None:
    wanted = review.aim(0.01)
    risen = review.followed(length, 0.7, wanted, length)
    assert length < risen <= review.MOST_FACTOR * length
    assert review.followed(length, 0.8, wanted, length) < risen
    assert review.followed(risen, wanted, wanted, length) == pytest.approx(risen)
    assert length <= review.followed(risen, 0.99, wanted, length) < risen
    assert review.followed(length, 1.0, wanted, length) == length
    assert review.followed(review.MOST, 0.7, wanted, length) == review.MOST


def test_a_level_that_has_yet_to_learn_the_surface_keeps_its_weight() -> None:
    assert review.followed(15.0, 0.3, review.aim(0.0), 15.0) == 15.0
    assert review.followed(40.0, 0.3, review.aim(0.0), 15.0) == 40.0


def test_more_is_wanted_of_points_that_were_noisy() -> None:
    assert 0.9 < review.aim(0.0) < review.aim(0.005) < review.aim(0.02) <= review.aim(1.0) < 1


def test_the_steps_that_follow_have_the_weight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(review, "within", lambda weights, surface: 0.7)
    sampler = Sampler(load_ball(tmp_path), [FLAT], [0.05], torch.device("cpu"), np.random.default_rng(0))
    on, around = sampler.surface(2048), sampler.volume(2048)
    losses = []
    for wanted in (None, review.aim(0.0)):
        weights = initial((8, 1), 5.0, 1, torch.Generator().manual_seed(0))
        for w in weights:
            w.grad = torch.zeros_like(w)
        step = LevelStep(on, around, RESIDUAL, torch.Generator().manual_seed(0))
        review.Review(step, sampler, on, RESIDUAL, 2000, wanted, False, 0.1)(weights, 0.9)
        assert step.weight.value == RESIDUAL.value
        assert (step.weight.length > RESIDUAL.length) == (wanted is not None)
        losses.append(step(weights))
    assert losses[1] > losses[0]


@pytest.mark.usefixtures("quick")
def test_residuals_of_clouds_follow_unless_the_user_says_a_length(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = unit(np.random.default_rng(0).normal(size=(4000, 3)))
    shapes: list[tuple[Shape, dict[str, float], int]] = [
        (CloudShape(SurfacePoints(points, points), "cloud", {}), {}, 5),
        (CloudShape(SurfacePoints(points, points), "cloud", {}), {"length": 2.0}, 0),
        (load_ball(tmp_path), {}, 0),
    ]
    measured = []

    def counted(weights: Weights, pool: Pool) -> float:
        measured.append(len(pool.points))
        return 1.0

    monkeypatch.setattr(review, "within", counted)
    for shape, weights, reviews in shapes:
        measured.clear()
        train(shape, replace(SMALL_SETTINGS, weights=weights, texture=False))
        assert len(measured) == reviews, f"{shape.name}, {weights}"


def test_values_on_the_surface_weigh_more_late_and_the_loss_stays_comparable(tmp_path: Path) -> None:
    sampler = Sampler(load_ball(tmp_path), [FLAT], [0.05], torch.device("cpu"), np.random.default_rng(0))
    on, around = sampler.surface(2048), sampler.volume(2048)

    def step_of() -> LevelStep:
        return LevelStep(on, around, RESIDUAL, torch.Generator().manual_seed(0))

    losses, sizes, weights = [], [], initial((8, 1), 5.0, 1, torch.Generator().manual_seed(0))
    for share in (LATE - 0.1, LATE):
        for w in weights:
            w.grad = torch.zeros_like(w)
        step = step_of()
        review.Review(step, sampler, on, RESIDUAL, 2000, None, True, 0.1)(weights, share)
        step.hard = None
        losses.append(step(weights))
        sizes.append(float(torch.cat([w.grad.ravel() for w in weights if w.grad is not None]).norm()))
    assert step.weight.value == LATE_VALUE * RESIDUAL.value
    assert sizes[1] > 5 * sizes[0]
    assert losses[1] == pytest.approx(losses[0], rel=1e-4)

    again = step_of()
    LevelDraws(again, sampler).restore(LevelDraws(step, sampler).snapshot())
    assert again.weight == step.weight
    review.Review(step, sampler, on, RESIDUAL, 2000, None, True, 0.1)(weights, 0.3)
    assert step.weight == RESIDUAL, "a restart begins as the level did"
    assert LATE in fit.REVIEWS


def test_a_search_that_would_take_too_much_of_the_time_left_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sampler = Sampler(load_ball(tmp_path), [FLAT], [0.05], torch.device("cpu"), np.random.default_rng(0))
    on, around = sampler.surface(2048), sampler.volume(2048)
    step = LevelStep(on, around, RESIDUAL, torch.Generator().manual_seed(0))
    searches: list[int] = []
    monkeypatch.setattr(sampler, "hard", lambda *asked: searches.append(1))
    looks = review.Review(step, sampler, on, RESIDUAL, 2000, None, True, 0.1)
    looks(FLAT, 0.3, 1.0)
    assert len(searches) == 1, "the first is always made: nobody knows how long it takes"
    looks.seconds = 2.0
    looks(FLAT, LATE, 1.9 / review.LONGEST)
    assert len(searches) == 1
    assert step.weight.value == LATE_VALUE * RESIDUAL.value, "what costs nothing is done"
    looks(FLAT, LATE, 2.1 / review.LONGEST)
    assert len(searches) == 2


@pytest.mark.usefixtures("quick")
def test_it_is_so_in_residuals_of_still_meshes_unless_the_user_says_a_value(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = unit(np.random.default_rng(0).normal(size=(4000, 3)))
    shapes: list[tuple[Shape, dict[str, float], set[float]]] = [
        (load_ball(tmp_path), {}, {10_000.0, 300_000.0, 3_000_000.0}),
        (load_ball(tmp_path), {"value": 5000.0}, {5000.0}),
        (CloudShape(SurfacePoints(points, points), "cloud", {}), {}, {10_000.0, 300_000.0}),
    ]
    seen: set[float] = set()
    called = LevelStep.__call__

    def watched(step: LevelStep, weights: Weights) -> float:
        seen.add(step.weight.value)
        return called(step, weights)

    monkeypatch.setattr(LevelStep, "__call__", watched)
    for shape, weights, values in shapes:
        seen.clear()
        train(shape, replace(SMALL_SETTINGS, weights=weights, texture=False))
        assert seen == values, f"{shape.name}, {weights}"
