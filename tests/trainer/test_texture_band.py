"""In level 1's band, the texture has the same color at x and at x + t grad f, which coarse levels need (Fig. 9)."""

from dataclasses import replace

import numpy as np
import pytest

from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.trainer.config import TextureConfig, TrainingConfig
from mplicits.trainer.frozen_levels import FrozenLevels
from mplicits.trainer.networks.network import from_model
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.training_samples import Sampler
from support.ball_training import CPU, SMALL_SETTINGS, train


@pytest.fixture(scope="module")
def painted(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    """Make a ball of points whose color varies fast."""
    normals = np.random.default_rng(0).normal(size=(20_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    path = tmp_path_factory.mktemp("painted") / "points.npz"
    np.savez(path, points=normals, normals=normals, colors=0.5 + 0.4 * np.sin(6 * normals))
    return load_shape(str(path))[0]


def smear(model: Model) -> float:
    """Measure the mean change of color from x on the surface to x + t grad f, |t| up to level 1's delta."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(4000, 3)).astype(np.float32)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    program = lower(model)
    gradient, _ = interpret.field_gradient(program, points, len(model.levels))
    t = rng.uniform(-1, 1, (4000, 1)).astype(np.float32) * np.float32(model.levels[0].delta)
    here, there = (interpret.color(program, at) for at in (points, points + t * gradient))
    return float(np.abs(here - there).mean())


@pytest.mark.slow
def test_the_loss_keeps_the_color_constant_along_normals(painted: Shape) -> None:
    settings = replace(SMALL_SETTINGS, omegas=(8.0, 16.0, 12.0), steps=(150, 200, 900), texture_network=(32, 1))
    model = train(painted, settings)
    assert model.levels[0].delta > 3 * model.levels[1].delta, "the bands differ"
    without = train(painted, settings, config=TrainingConfig(texture=TextureConfig(smoothness=0.0)))
    assert smear(model) < 0.01
    assert smear(model) < 0.8 * smear(without)


@pytest.mark.slow
def test_the_texture_s_band_is_that_of_level_1(painted: Shape) -> None:
    model = train(painted, replace(SMALL_SETTINGS, steps=(150, 150, 1), texture=False))
    levels, deltas = [from_model(level.network) for level in model.levels], [level.delta for level in model.levels]
    band = Sampler(painted, FrozenLevels(levels, deltas, CPU), np.random.default_rng(0)).first_band(5000)
    program, points = lower(model), band.points.numpy()
    first = np.abs(interpret.field(program, points, 1))
    assert first.max() < deltas[0] * (1 + 1e-5)
    assert (np.abs(interpret.field(program, points, 2)) > deltas[1]).any(), "wider than level 2's"
    assert np.quantile(first, 0.9) > 0.5 * deltas[0]
    expected, _ = interpret.field_gradient(program, points, 2)
    np.testing.assert_allclose(band.frozen_gradient.numpy(), expected, atol=2e-4)
