"""Small trainings from end to end: quality, nesting, repeatability, and the time they take."""

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest
import torch

from mplicits.model.errors import UserError
from mplicits.model.model import Model, size_text
from mplicits.model.model_file import load, save
from mplicits.trainer import held_out_errors, machine, plan
from mplicits.trainer.config import BudgetConfig, SamplingConfig
from mplicits.trainer.frozen_levels import FrozenLevels
from mplicits.trainer.networks.network import from_model
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, Shape
from mplicits.trainer.train import Training
from mplicits.trainer.training_samples import Sampler
from support.ball_training import CPU, QUICK, SMALL_SETTINGS, Log, train


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    machine.prepare(torch.device("cpu"))


@pytest.fixture(scope="module")
def model(ball: Shape) -> Model:
    return train(ball)


def field(model: Model, points: Doubles, levels: int) -> Doubles:
    """Evaluate the sum of the first `levels` levels in NumPy."""
    total = np.zeros(len(points))
    for part in model.levels[:levels]:
        hidden = points.astype(np.float32)
        for layer in part.network[:-1]:
            hidden = np.sin(hidden @ layer.weight.T + layer.bias)
        total += (hidden @ part.network[-1].weight.T + part.network[-1].bias)[:, 0]
    return total


def directions(count: int) -> Doubles:
    drawn = np.random.default_rng(7).normal(size=(count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def test_a_sphere_is_learnt(model: Model) -> None:
    """Level 1 is close to |x| - 1 in the whole ball, and level 2 on the surface."""
    points = directions(4000)
    radii = np.random.default_rng(8).uniform(0.6, 1, (4000, 1))
    assert np.abs(field(model, points * radii, 1) - (radii[:, 0] - 1)).mean() < 0.05
    assert np.abs(field(model, points, 2)).mean() < 3e-3
    assert model.scale == pytest.approx(3, rel=1e-3)


def test_the_provenance_holds_measured_figures(model: Model) -> None:
    first, second = model.provenance["levels"]
    assert first["mean_f"] == pytest.approx(np.abs(field(model, directions(20_000), 1)).mean(), rel=0.3)
    assert second["mean_f"] < first["mean_f"]
    assert 0 < second["angle"] < first["angle"] < 20
    assert model.provenance["seed"] == 0
    assert model.provenance["source"]["file"] == "ball.ply"
    assert model.provenance["seconds"] > 0
    assert model.provenance["interrupted"] is False


def test_bands_hold_the_surface(ball: Shape, model: Model) -> None:
    """Every input point lies in every band (Eq. 3), and the band is 1.3 times as wide as it must be (Eq. 5)."""
    for i, part in enumerate(model.levels, start=1):
        largest = np.abs(field(model, ball.inputs(), i)).max()
        assert largest < part.delta
        drawn = np.abs(field(model, ball.surface(300_000, np.random.default_rng(5)).points, i)).max()
        assert part.delta == pytest.approx(1.3 * max(largest, drawn), rel=0.05)


def test_delta_is_equation_5() -> None:
    assert held_out_errors.delta(torch.tensor([0.01, -0.03, 0.02])) == pytest.approx(1.3 * 0.03)


def test_the_lipschitz_constant_is_near_one(model: Model) -> None:
    for part in model.levels:
        assert 0.9 < part.lipschitz < 2


def test_a_thick_ball_allows_full_steps(model: Model) -> None:
    for part in model.levels:
        assert (part.step_bound, part.band_step_bound) == (1, 1)


def test_the_iterations_are_the_paper_s(model: Model) -> None:
    assert [part.iterations for part in model.levels] == [20, 5]


def test_the_file_keeps_everything(model: Model, tmp_path: Path) -> None:
    save(model, tmp_path / "ball.safetensors")
    again = load(tmp_path / "ball.safetensors")
    assert again.sha256() == model.sha256()
    assert again.provenance == model.provenance


def test_a_seed_gives_the_same_weights(ball: Shape) -> None:
    short = dataclasses.replace(SMALL_SETTINGS, steps=(30, 30, 20))
    first = train(ball, short).sha256()
    assert train(ball, short).sha256() == first
    assert train(ball, dataclasses.replace(short, seed=1)).sha256() != first


def test_three_levels_have_the_sizes_of_the_settings(ball: Shape) -> None:
    settings = Settings(networks=((16, 1), (16, 1), (12, 0)), omegas=(8.0, 16.0, 24.0), steps=(120, 120, 120, 60))
    model = train(ball, settings)
    assert [size_text(part.network) for part in model.levels] == ["16x1", "16x1", "12x0"]
    assert model.levels[0].delta > model.levels[2].delta


def test_pools_hold_the_values_of_the_frozen_levels(ball: Shape, model: Model) -> None:
    """A pool's frozen values are those of the finished levels at its points, and its distances are exact.

    Only the distance of a stray is clipped.
    """
    frozen = [from_model(model.levels[0].network)]
    sampler = Sampler(ball, FrozenLevels(frozen, [model.levels[0].delta], CPU), np.random.default_rng(0))
    for pool in (sampler.surface(3000), sampler.volume(3000)):
        assert np.abs(field(model, pool.points.double().numpy(), 1) - pool.frozen.numpy()).max() < 1e-5
        assert pool.distance is not None
        reach = SamplingConfig.largest_distance * model.levels[0].delta
        exact = np.clip(np.linalg.norm(pool.points.numpy(), axis=1) - 1, -reach, reach)
        assert np.abs(pool.distance.numpy() - exact).max() < 5e-3
    assert (pool.frozen.abs() < model.levels[0].delta).all()


def test_a_training_takes_the_users_seconds(ball: Shape) -> None:
    began = time.perf_counter()
    train(ball, dataclasses.replace(SMALL_SETTINGS, seconds=4.0))
    assert 3 < time.perf_counter() - began < 200, "a busy machine is late; how late is for a benchmark"


def test_a_slow_preparation_leaves_half_of_each_stage_to_its_steps() -> None:
    """Here the shape takes longer to read than all the seconds, and the pool of level 2 as long as level 2 may."""
    settings = dataclasses.replace(SMALL_SETTINGS, seconds=60.0)
    now = time.perf_counter()
    budgets = plan.budgets(settings, 0, 0.0, True, now - 75, 2.0)
    assert sum(budget.seconds for budget in budgets) == pytest.approx(60)
    assert budgets[-1].deadline == pytest.approx(now + 30, abs=5)
    first, second, _ = budgets
    assert second.seconds > first.seconds
    late = dataclasses.replace(second, deadline=now - 5)
    assert plan.prepared(late, BudgetConfig()).deadline == pytest.approx(now + second.seconds / 2, abs=5)
    early = dataclasses.replace(second, deadline=now + 100)
    assert plan.prepared(early, BudgetConfig()) == early
    counted = plan.budgets(SMALL_SETTINGS, 0, 0.0, True, now - 75, 2.0)[0]
    assert plan.prepared(counted, BudgetConfig()) == counted


def test_seconds_without_a_step_are_refused(ball: Shape) -> None:
    config = dataclasses.replace(QUICK, budget=BudgetConfig(least=0.0))
    settings = dataclasses.replace(SMALL_SETTINGS, seconds=5.0)
    with pytest.raises(UserError, match="--seconds 5: no time was left"):
        Training(ball, settings, Log(), began=time.perf_counter() - 10, config=config).run()


def test_a_cloud_is_learnt(tmp_path: Path) -> None:
    normals = directions(6000)
    np.savez(tmp_path / "cloud.npz", points=5 * normals, normals=normals)
    shape, _ = load_shape(str(tmp_path / "cloud.npz"))
    model = train(shape)
    points = directions(3000)
    assert np.abs(field(model, points, 2)).mean() < 5e-3
    assert field(model, 0.5 * points, 1).max() < -0.3
    corners = np.random.default_rng(3).uniform(-1, 1, (3000, 3))
    assert field(model, corners[np.linalg.norm(corners, axis=1) > 1.15], 1).min() > 0


def test_colors_are_learnt(tmp_path: Path) -> None:
    normals = directions(6000)
    colors = np.where(normals[:, :1] > 0, (0.9, 0.1, 0.1), (0.1, 0.1, 0.9))
    np.savez(tmp_path / "cloud.npz", points=normals, normals=normals, colors=colors)
    shape, _ = load_shape(str(tmp_path / "cloud.npz"))
    settings = dataclasses.replace(SMALL_SETTINGS, networks=((24, 1),), omegas=(8.0,), steps=(100, 400))
    model = train(shape, settings)
    assert model.texture is not None
    points = directions(2000)[np.abs(directions(2000)[:, 0]) > 0.2]
    hidden = points.astype(np.float32)
    for layer in model.texture[:-1]:
        hidden = np.sin(hidden @ layer.weight.T + layer.bias)
    learnt = hidden @ model.texture[-1].weight.T + model.texture[-1].bias
    assert np.abs(learnt - np.where(points[:, :1] > 0, (0.9, 0.1, 0.1), (0.1, 0.1, 0.9))).mean() < 0.06
    assert train(shape, dataclasses.replace(settings, texture=False)).texture is None
