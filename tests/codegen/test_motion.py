"""A moving model: field and pictures at several times, in numpy and in GLSL, and the cells that rays skip."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake, standalone
from mplicits.codegen.targets.read_shader import read_shader
from mplicits.field import digits, interpret
from mplicits.field.cell_codes import EMPTY
from mplicits.field.cells import MOMENTS, Cells
from mplicits.field.surface_points import near_surface
from mplicits.ir.at_time import SAMPLED_TIMES, at_sampled_times, at_time
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.dense import dense_march
from oracles.march import march
from support.dense_views import STOP, VIEWS
from support.moving_model import COMPARED_TIMES, distance, moving_model
from support.random_model import random_model

SIDE = 64
STEP = 1 / (MOMENTS - 1)
"""Time between two grids of cells."""


@pytest.fixture(scope="module")
def model() -> Model:
    return moving_model()


@pytest.fixture(scope="module")
def renderer(osmesa: Context, model: Model) -> Renderer:
    return Renderer(osmesa, bake(model, passes=True))


def data(renderer: Renderer, camera: Camera, time: float, schedule: str = "relaxed") -> NDArray[np.float32]:
    """Return (SIDE, SIDE, 4): for each pixel the distance, the steps, the level and whether the ray hit."""
    return renderer.render((SIDE, SIDE), camera, RenderOptions(shade="data", time=time, schedule=schedule))


def test_the_fitted_model_is_the_splitting_ball(model: Model) -> None:
    program = lower(model)
    for time in COMPARED_TIMES:
        points = near_surface(at_time(program, time))
        assert len(points) > 1000
        assert np.abs(distance(np.pad(points, ((0, 0), (0, 1)), constant_values=time))).mean() < 0.03


@pytest.mark.parametrize("time", [0.0, 0.3, 1.0])
def test_a_program_at_a_time_equals_the_moving_program(time: float) -> None:
    moving = lower(random_model((12, 2), (8, 0), texture=(5, 1), inputs="xyzt"), digits=4)
    there = at_time(moving, time)
    assert not there.moving
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3)).astype(np.float32)
    for level in (1, 2):
        for ours, theirs in zip(
            interpret.field_gradient(there, points, level),
            interpret.field_gradient(moving, points, level, time),
            strict=True,
        ):
            np.testing.assert_allclose(ours, theirs, atol=2e-5)
    np.testing.assert_allclose(interpret.color(there, points), interpret.color(moving, points, time), atol=1e-5)
    assert at_time(there, 0.7) is there


@pytest.mark.parametrize("time", COMPARED_TIMES)
def test_glsl_equals_the_reference_at_each_time(renderer: Renderer, model: Model, time: float) -> None:
    drawn = data(renderer, VIEWS[0], time, "plain").reshape(-1, 4)
    eye, directions, footprint = VIEWS[0].rays(SIDE, SIDE)
    program = at_time(lower(model), time)
    rays = march(program, eye, directions.reshape(-1, 3), 2, footprint)
    assert 100 < rays.hit.sum() < SIDE**2 / 2
    assert (rays.hit == (drawn[:, 3] > 0.5)).mean() > 0.999
    both = rays.hit & (drawn[:, 3] > 0.5)
    assert np.abs(rays.t - drawn[:, 0])[both].mean() < 1e-4
    points = (eye + rays.t[both, None] * directions.reshape(-1, 3)[both]).astype(np.float32)
    normals = interpret.field_gradient(program, points, 2)[0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for shading, expected in (("normal", 0.5 + 0.5 * normals), ("texture", interpret.color(program, points))):
        seen = renderer.render((SIDE, SIDE), VIEWS[0], RenderOptions(shade=shading, time=time))
        assert np.abs(seen.reshape(-1, 4)[both, :3] - expected).mean() < 2e-3, shading


def test_the_grids_of_cells_lose_no_pixel_at_any_time(renderer: Renderer, model: Model) -> None:
    """The times are those of the grids, and in between, where the surface is farthest from its place in a grid."""
    cells = renderer.shader.cells
    assert cells is not None
    assert cells.moments == MOMENTS
    program = lower(model)
    for k, time in enumerate((0.0, 1e-4, 1.5 * STEP, 10 * STEP, 0.5, 20.3 * STEP, 1 - 1e-4, 1.0)):
        camera = VIEWS[k]
        eye, directions, footprint = camera.rays(SIDE, SIDE)
        closest, _ = dense_march(at_time(program, time), eye, directions.reshape(-1, 3), 2, footprint)
        plain, relaxed = (data(renderer, camera, time, schedule) for schedule in ("plain", "relaxed"))
        hit, plainly = (drawn[..., 3].ravel() > 0.5 for drawn in (relaxed, plain))
        assert not ((closest == 0) & ~hit).any()
        assert not (hit & ~plainly & (closest > STOP)).any()
        both = (plain[..., 3] > 0.5) & (relaxed[..., 3] > 0.5)
        pixels = np.abs(plain[..., 0] - relaxed[..., 0])[both] / (footprint * plain[..., 0][both])
        assert np.quantile(pixels, 0.98) < 0.3, "each ends within 1/20 pixel of the surface"
        assert relaxed[..., 1].mean() < 0.5 * plain[..., 1].mean()


def test_no_cell_with_the_surface_is_empty_at_any_time(model: Model) -> None:
    program = lower(model)
    cells = Cells(program, 32, 8)
    for time in np.linspace(0, 1, 17):
        surface = near_surface(at_time(program, float(time)))
        value = interpret.field(at_time(program, float(time)), surface, 2)
        surface = surface[np.abs(value) < 1e-3]
        x, y, z = (np.floor((surface / cells.half + 1) / 2 * cells.count).astype(int)).T
        grid = cells.grid(float(time))
        assert (grid[z, y, x] >= EMPTY).all()
        assert (grid >= EMPTY).mean() < 0.3
    assert [cells.holds(time) for time in (-0.1, 0.0, 0.5, 1.0, 1.1)] == [False, True, True, True, False]


def test_a_moving_shader_is_read_back_and_draws_the_same_without_cells(
    osmesa: Context, renderer: Renderer, model: Model
) -> None:
    read, _, _ = read_shader(standalone(model))
    assert read.moving
    alone = Renderer(osmesa, read)
    ours, theirs = data(renderer, VIEWS[1], 0.8), data(alone, VIEWS[1], 0.8)
    alone.release()
    assert (ours[..., 3] == theirs[..., 3]).mean() > 0.999
    assert not np.array_equal(theirs[..., 3], data(renderer, VIEWS[1], 0.0)[..., 3])


def test_fewest_digits_suffice_at_every_time(model: Model) -> None:
    fewest = digits.fewest_digits(model)
    allowed = digits.SHARE * model.levels[-1].delta
    for exact, rounded in zip(at_sampled_times(lower(model)), at_sampled_times(lower(model, fewest)), strict=True):
        assert digits.error(exact, rounded, near_surface(exact)) < allowed
    assert len(at_sampled_times(lower(model))) == len(SAMPLED_TIMES)
    assert len(at_sampled_times(lower(random_model((8, 1))))) == 1
