"""Sphere tracing against dense marching, the shaders' steps against NumPy's, and both against the analytic shape."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.codegen.targets.shader import NEWTON_STEPS, Shader
from mplicits.field.cell_codes import EMPTY, interpolated
from mplicits.field.cells import NEAR, NEAR_IN_FILE, Cells
from mplicits.field.interpret import nested_field
from mplicits.ir.lower import lower
from mplicits.ir.program import Program
from mplicits.model.gallery import model_path
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.trainer import tracing
from mplicits.trainer.networks.network import from_model
from mplicits.trainer.shapes import demo
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.dense import dense_march
from oracles.march import Rays, march
from support.dense_views import STOP, VIEWS, compare
from support.paths import DEMO

SIDE = 64


@pytest.fixture(scope="module")
def model() -> Model:
    return load(DEMO)


@pytest.fixture(scope="module")
def program(model: Model) -> Program:
    return lower(model)


@pytest.fixture(scope="module")
def renderer(osmesa: Context, model: Model) -> Renderer:
    return Renderer(osmesa, bake(model))


@pytest.fixture(scope="module")
def in_passes(model: Model) -> Shader:
    return bake(model, passes=True)


def data(renderer: Renderer, camera: Camera, side: int = SIDE, **options: int | str) -> NDArray[np.float32]:
    """Return (side, side, 4): distance, steps, level and hit of each pixel's ray."""
    return renderer.render((side, side), camera, RenderOptions(shade="data", **options))  # type: ignore[arg-type]


def rays_of(camera: Camera, side: int = SIDE, every: int = 1) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return origin, directions (N, 3) and footprint of the rays of every k-th pixel along each axis."""
    eye, directions, footprint = camera.rays(side, side)
    return eye, directions[::every, ::every].reshape(-1, 3), footprint


def assert_same(rays: Rays, drawn: NDArray[np.float32]) -> None:
    """Compare NumPy's rays with a picture of `data`."""
    drawn = drawn.reshape(-1, 4)
    assert (rays.hit == (drawn[:, 3] > 0.5)).mean() > 0.998
    assert (rays.steps == drawn[:, 1]).mean() > 0.98, "steps may differ where rounding moves f across a threshold"
    assert np.abs(rays.t - drawn[:, 0])[rays.hit].mean() < 1e-4


@pytest.mark.slow
def test_ten_views_have_no_holes_and_the_same_silhouette_as_dense_marching(osmesa: Context, model: Model) -> None:
    difference = compare(model, osmesa, SIDE)
    assert difference.holes == 0
    assert difference.extra <= 0.002 * difference.outline
    assert np.median(difference.apart) < 0.002
    assert np.quantile(difference.apart, 0.9) < 0.01, "only grazing rays may stop early"


def bounded(model: Model, step_bound: float, band_step_bound: float) -> Model:
    """Return a model with these bounds at every level."""
    levels = (replace(level, step_bound=step_bound, band_step_bound=band_step_bound) for level in model.levels)
    return replace(model, levels=tuple(levels))


@pytest.mark.slow
def test_measured_bounds_lose_no_pixel_and_make_fewer_steps(osmesa: Context, renderer: Renderer, model: Model) -> None:
    """Dense marching decides where the picture differs from a picture with steps of 0.8."""
    levels, deltas = [from_model(level.network) for level in model.levels], [level.delta for level in model.levels]
    points = torch.from_numpy(demo.DemoShape().inputs().astype(np.float32))
    band, last = tracing.measure(levels, deltas, points).step_bounds
    assert 0.8 < band <= 1
    assert last == 1, "the last level is wrong by less than any part of this shape is thin"
    traced = bounded(model, last, band)
    shader = Renderer(osmesa, bake(traced))
    for camera in VIEWS[:3]:
        eye, directions, footprint = camera.rays(SIDE, SIDE)
        old, new = (data(each, camera, schedule="plain") for each in (renderer, shader))
        differ = (old[..., 3] != new[..., 3]) | (np.abs(old[..., 0] - new[..., 0]) > 0.02)
        closest, end = dense_march(lower(model), eye, directions[differ], 2, footprint)
        hit, t = new[differ][:, 3] > 0.5, new[differ][:, 0]
        assert not ((closest == 0) & (~hit | (t > end + 0.02))).any()
        assert not (hit & (closest > STOP)).any()
        assert new[..., 1].sum() < 0.95 * old[..., 1].sum()
    shader.release()


def test_numpy_and_glsl_use_the_same_bound_for_the_same_step(osmesa: Context, model: Model) -> None:
    uneven = bounded(model, 0.9, 0.6)
    shader = Renderer(osmesa, bake(uneven))
    eye, directions, footprint = rays_of(VIEWS[0])
    for level in (1, 2):
        steps = data(shader, VIEWS[0], level=level, schedule="plain")[..., 1].ravel()
        same, swapped = (
            march(lower(each), eye, directions, level, footprint, narrow=shader.shader.narrow).steps == steps
            for each in (uneven, bounded(model, 0.6, 0.9))
        )
        assert same.mean() > 0.98
        assert swapped.mean() < 0.9
    shader.release()


def test_one_round_as_in_the_paper_leaves_holes(renderer: Renderer) -> None:
    """Rounds exist because of these holes; if this test fails, rounds are unnecessary."""
    drawn = [data(renderer, VIEWS[0], rounds=rounds, schedule="plain") for rounds in (32, 1)]
    full, single = (picture[..., 3] > 0.5 for picture in drawn)
    assert (full & ~single).sum() > 0.05 * full.sum()


@pytest.mark.parametrize(("level", "rounds"), [(2, 32), (2, 1), (1, 32)])
def test_the_plain_march_in_numpy_takes_the_same_steps(
    renderer: Renderer, program: Program, level: int, rounds: int
) -> None:
    eye, directions, footprint = rays_of(VIEWS[0])
    rays = march(program, eye, directions, level, footprint, rounds, narrow=renderer.shader.narrow)
    assert_same(rays, data(renderer, VIEWS[0], level=level, rounds=rounds, schedule="plain"))
    assert rays.evaluations[0] == rays.steps.sum()
    assert rays.traced[0][0] == np.count_nonzero(rays.steps)
    assert rays.evaluations_outside <= rays.evaluations[0]


def test_the_relaxed_march_in_numpy_takes_the_same_steps(osmesa: Context, in_passes: Shader, program: Program) -> None:
    """The last level skips by the grid of cells and takes Newton's steps; level 1 has neither."""
    renderer = Renderer(osmesa, in_passes)
    eye, directions, footprint = rays_of(VIEWS[0])
    for level, cells, looks in ((1, None, 0), (2, in_passes.cells, NEWTON_STEPS)):
        rays = march(program, eye, directions, level, footprint, schedule="relaxed", cells=cells, newton_steps=looks)
        assert_same(rays, data(renderer, VIEWS[0], level=level))
    renderer.release()


def test_newton_steps_end_most_rays_within_a_twentieth_of_a_pixel(program: Program, in_passes: Shader) -> None:
    eye, directions, footprint = rays_of(VIEWS[0], 512, every=8)
    relaxed = partial(march, program, eye, directions, 2, footprint, schedule="relaxed", cells=in_passes.cells)
    without, looked = relaxed(), relaxed(newton_steps=NEWTON_STEPS)
    assert np.array_equal(looked.hit, without.hit)
    assert sum(looked.evaluations) + 2 * 2 * looked.gradient_evaluations < sum(without.evaluations)
    ended = looked.hit & (looked.steps <= NEWTON_STEPS)
    assert ended.sum() > 0.5 * looked.hit.sum()
    points = (eye + looked.t[ended, None] * directions[ended]).astype(np.float32)
    assert (np.abs(nested_field(program, points, 2)[0]) < 0.05 * footprint * looked.t[ended]).all()


def test_a_shader_of_one_file_skips_cells_and_has_narrow_bands(renderer: Renderer, program: Program) -> None:
    shader = renderer.shader
    assert shader.few_cells is not None
    assert len(shader.narrow) == 1
    longer = 0
    for first, last in (("const uint narrow_bands[", "}\n"), ("#define FEW_CELLS", ");\n")):
        start = shader.text.index(first)
        longer += shader.text.index(last, start) + len(last) - start
    assert longer <= 0.05 * (len(shader.text) - longer)
    eye, directions, footprint = rays_of(VIEWS[0])
    relaxed = partial(march, program, eye, directions, 2, footprint, schedule="relaxed", near=NEAR_IN_FILE)
    rays = relaxed(cells=shader.few_cells, narrow=shader.narrow)
    assert_same(rays, data(renderer, VIEWS[0]))
    assert rays.evaluations[0] < 0.85 * relaxed().evaluations[0]
    assert rays.evaluations[1] < 0.9 * relaxed(cells=shader.few_cells).evaluations[1]


def test_the_relaxed_march_costs_little_and_sees_the_same(
    renderer: Renderer, in_passes: Shader, program: Program
) -> None:
    costs = [program.cost(function).multiply_adds for function in program.values]
    eye, directions, footprint = rays_of(VIEWS[0], 96)
    plain = march(program, eye, directions, 2, footprint)
    closest, _ = dense_march(program, eye, directions, 2, footprint)
    in_file = renderer.shader
    for shader, cells, share, near in (
        (in_passes, in_passes.cells, 1 / 4, NEAR),
        (in_file, in_file.few_cells, 1 / 1.6, NEAR_IN_FILE),
    ):
        relaxed = march(
            *(program, eye, directions, 2, footprint),
            schedule="relaxed",
            cells=cells,
            narrow=shader.narrow,
            near=near,
        )
        assert np.dot(relaxed.evaluations, costs) < share * np.dot(plain.evaluations, costs)
        assert not ((closest == 0) & ~relaxed.hit).any()
        assert not (relaxed.hit & (closest > STOP)).any()
        both = plain.hit & relaxed.hit
        pixels = np.abs(plain.t - relaxed.t)[both] / (footprint * plain.t[both])
        assert np.quantile(pixels, 0.99) < 0.25, "both end within 1/20 pixel of the surface"


def test_a_grid_that_leads_into_the_shape_costs_few_steps(program: Program) -> None:
    """Between the middles and corners of cells its values may be too large: then the last sphere was not free."""
    cells = Cells(program)
    codes = cells.grid()
    codes[codes >= EMPTY] = np.minimum(codes[codes >= EMPTY], 255 - 25) + 25
    eye, directions, footprint = rays_of(VIEWS[0])
    rays = march(program, eye, directions, 2, footprint, schedule="relaxed", cells=cells)
    assert rays.hit.mean() > 0.3
    assert rays.steps.max() < 64, "false position must not repeat in a bracket without a zero"


def test_no_point_of_the_surface_is_in_an_empty_cell(in_passes: Shader) -> None:
    cells = in_passes.cells
    assert cells is not None
    surface = demo.DemoShape().surface(20_000, np.random.default_rng(1)).points
    x, y, z = (np.floor((surface / cells.half + 1) / 2 * cells.count).astype(int)).T
    assert (cells.grid()[z, y, x] >= EMPTY).all()
    assert (cells.grid() >= EMPTY).mean() < 0.1, "most of the ball is empty"


def test_the_grid_s_values_are_at_most_the_field_and_near_it(in_passes: Shader, program: Program) -> None:
    rng, cells = np.random.default_rng(2), in_passes.cells
    assert cells is not None
    surface = demo.DemoShape().surface(20_000, rng)
    points = (surface.points + rng.uniform(0, 0.01, (20_000, 1)) * surface.normals).astype(np.float32)
    scale = 0.5 * cells.count / cells.half
    known = interpolated(cells.grid(), np.asarray(scale * (points + cells.half), np.float64)) / scale
    f = nested_field(program, points, 2)[0]
    free = (f - known)[f > 0]
    assert (free > -1e-3).all(), "between the middles and corners of cells a value may be slightly too large"
    assert np.quantile(free, 0.002) > -3e-4
    assert np.median(free) < 1e-3


def test_depth_is_the_analytic_shape_s(renderer: Renderer) -> None:
    for camera in VIEWS[:2]:
        eye, directions, _ = camera.rays(96, 96)
        traced = data(renderer, camera, 96)
        hit, steps = traced[..., 3] > 0.5, traced[..., 1]
        points = eye + traced[hit][:, :1] * directions[hit]
        distance = np.abs(demo.DemoShape().distance(points))
        assert distance.mean() < 2e-3
        assert np.quantile(distance, 0.99) < 0.012
        assert 1 <= np.median(steps[steps > 0]) <= 20


def test_a_camera_inside_the_ball_sees_the_shape_and_one_that_looks_away_sees_nothing(renderer: Renderer) -> None:
    inside = data(renderer, Camera(0, 0, distance=0.95))
    assert 0.01 < (inside[..., 3] > 0.5).mean() < 1
    away = data(renderer, Camera(0, 0, distance=3, target=(0, 0, -100)))
    assert not away[..., 3].any()


def test_rays_that_begin_inside_the_shape_end_at_once(renderer: Renderer, program: Program) -> None:
    surface = demo.DemoShape().surface(100, np.random.default_rng(0))
    eye = surface.points[0] - 0.05 * surface.normals[0]
    assert demo.DemoShape().distance(eye[None])[0] < -0.03
    camera = Camera(0, 0, distance=1e-3, target=(float(eye[0]), float(eye[1]), float(eye[2])))
    drawn = data(renderer, camera)
    assert not drawn[..., 3].any()
    assert drawn[..., 1].max() <= 2
    eye, directions, footprint = rays_of(camera)
    assert march(program, eye, directions, 2, footprint).steps.max() <= 2


def test_a_thin_band_takes_no_pixel_from_a_silhouette() -> None:
    """Rays that graze Spot's head on the way to a horn take 182 steps; after 32 rounds, two of them missed it."""
    program = lower(load(model_path("spot")))
    eye, directions, footprint = Camera(215, 15).rays(1024, 1024)
    assert march(program, eye, directions[215:225, 322:345].reshape(-1, 3), 2, footprint).hit.all()
