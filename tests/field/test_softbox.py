"""The shading softbox: openness against formulas, and the shader's pictures against NumPy."""

import re
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.codegen.targets import glsl330
from mplicits.codegen.targets.read_shader import read_shader
from mplicits.field.lowest import lowest_point
from mplicits.field.openness import BLOCK, LIGHT_SIZE, coarse, openness
from mplicits.ir.lower import lower
from mplicits.model.model_file import load
from mplicits.model.srgb import to_srgb
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.floor_light import BEND, between
from support.fitted_model import fitted_model, radius
from support.paths import DEMO

UP = np.array((0.0, 1.0, 0.0))
LIGHT = np.array((-0.5, 0.7, 0.8)) / np.linalg.norm((-0.5, 0.7, 0.8))
WHITE = (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)
SIDE = 64


@pytest.fixture(scope="module")
def ball(osmesa: Context) -> Iterator[Renderer]:
    renderer = Renderer(osmesa, glsl330.bake(fitted_model()))
    yield renderer
    renderer.release()


def test_the_floor_is_at_the_lowest_point() -> None:
    directions = np.random.default_rng(0).normal(size=(400_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    lowest = (radius(directions) * directions[:, 1]).min()
    assert lowest_point(lower(fitted_model())) == pytest.approx(lowest, abs=0.01)


def test_a_parsed_shader_keeps_its_floor() -> None:
    model = load(DEMO)
    shader, _, _ = read_shader(glsl330.standalone(model, "texture"))
    assert shader.ground == pytest.approx(lowest_point(lower(model)), abs=1e-4)
    text = re.search(r"const float GROUND = (\S+);", shader.text)
    assert text is not None
    assert float(text[1]) == shader.ground


def test_level_1_grows_like_a_distance_outside_the_ball() -> None:
    points = np.random.default_rng(1).normal(size=(300, 3))
    points *= np.linspace(0.8, 3, 300)[:, None] / np.linalg.norm(points, axis=1)[:, None]
    excess = coarse(lower(fitted_model()), points) - (np.linalg.norm(points, axis=1) - 0.75)
    assert excess.max() < 0.2, "the ball's bumps and level 1's error"
    assert excess.min() > -0.55, "at most the detour around a shape on the far side of the ball"


def test_the_shadow_of_a_ball_is_that_of_a_disc_of_light() -> None:
    rng, program = np.random.default_rng(2), lower(fitted_model())
    ground = lowest_point(program)
    points = np.stack([rng.uniform(-1, 2.5, 200), np.full(200, ground), rng.uniform(-3, 1, 200)], axis=1)
    seen = openness(program, points, np.tile(UP, (200, 1)), LIGHT, ground, True)[:, 1]
    across = np.cross(LIGHT, UP) / np.linalg.norm(np.cross(LIGHT, UP))
    turns, radii = rng.uniform(0, 2 * np.pi, 400), LIGHT_SIZE * np.sqrt(rng.uniform(0, 1, 400))
    toward = (
        LIGHT + (radii * np.cos(turns))[:, None] * across + (radii * np.sin(turns))[:, None] * np.cross(across, LIGHT)
    )
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    along = -points @ toward.T
    hidden = ((points**2).sum(axis=1)[:, None] - along**2 < 0.75**2) & (along > 0)
    difference = seen - (1 - hidden.mean(axis=1))
    assert np.abs(difference).mean() < 0.04
    assert np.abs(difference).max() < 0.4, "half of the disc, where the edge of one of the ball's bumps is"


def test_the_floor_is_darkest_where_the_shape_stands() -> None:
    program = lower(fitted_model())
    ground = lowest_point(program)
    points = np.array([(x, ground, 0) for x in (0.2, 0.4, 0.6, 1.0, 1.6)])
    sky = openness(program, points, np.tile(UP, (5, 1)), LIGHT, ground, True)[:, 0]
    assert sky[0] < 0.25
    assert np.all(np.diff(sky) >= 0)
    assert sky[-1] > 0.99


@pytest.mark.parametrize("elevation", [15, 60])
def test_the_shader_s_floor_is_numpy_s(ball: Renderer, elevation: float) -> None:
    camera, program = Camera(0, elevation), lower(fitted_model())
    picture = ball.render((SIDE, SIDE), camera, RenderOptions(shade="softbox", background=WHITE))
    eye, directions, _ = camera.rays(SIDE, SIDE)
    on_floor = (picture[..., 3] == 0) & (directions[..., 1] < 0)
    along = directions[on_floor]
    ground = ball.shader.ground
    points = eye + ((ground - eye[1]) / along[:, 1])[:, None] * along
    sky, key, _ = openness(program, points, np.tile(UP, (len(points), 1)), LIGHT, ground, True).T
    lit = (0.9 * LIGHT[1] * key + 0.45 * sky) / (0.9 * LIGHT[1] + 0.45)
    np.testing.assert_allclose(picture[on_floor][:, 0], to_srgb(lit), atol=0.01)
    assert lit.min() < 0.5, "some of it is in the shadow"


def test_similar_corners_interpolate_the_floor_s_openness() -> None:
    rng = np.random.default_rng(3)
    slope, share = rng.uniform(-0.2, 0.2, (50, 2, 3)), rng.uniform(0, 1, (50, 2))
    ways = np.stack(np.meshgrid((-1, 0, 1, 2), (-1, 0, 1, 2)), axis=-1)
    corners = 0.5 + np.einsum("ijd,ndc->nijc", ways, slope)
    found, alike = between(corners, share)
    np.testing.assert_allclose(found, 0.5 + np.einsum("nd,ndc->nc", share, slope))
    assert alike.all()
    corners[:20, 2, 1, 0] += 2 * BEND
    corners[20:30, 1, 2, 1] = np.nan
    corners[30:40, 0, 1, 1] -= 2 * BEND
    np.testing.assert_array_equal(between(corners, share)[1], np.arange(50) >= 40)


def test_passes_evaluate_the_floor_where_the_corners_of_its_blocks_differ(osmesa: Context) -> None:
    side, program, camera = 128, lower(fitted_model()), Camera(0, 35)
    shader = glsl330.bake(fitted_model(), passes=True)
    renderer = Renderer(osmesa, shader)
    picture = renderer.render((side, side), camera, RenderOptions(shade="softbox", background=WHITE))[::-1]
    renderer.release()
    eye, directions, _ = camera.rays(side, side)
    along = directions[::-1]
    points = eye + ((shader.ground - eye[1]) / along[..., 1:2]) * along
    up = np.tile(UP, (side**2, 1))
    exact = openness(program, points.reshape(-1, 3), up, LIGHT, shader.ground, True)
    exact[along[..., 1].ravel() >= 0] = np.nan
    exact = exact.reshape(side, side, 3)
    row, column = np.nonzero((picture[..., 3] == 0) & (along[..., 1] < 0))
    inside = np.maximum(row, column) < side - 2 * BLOCK  # where the picture has all corners
    inside &= np.minimum(row, column) >= BLOCK
    row, column = row[inside], column[inside]
    low = np.stack([column, row], axis=1) // BLOCK * BLOCK
    near = BLOCK * np.arange(-1, 3)
    corners = exact[low[:, 1, None, None] + near[:, None], low[:, 0, None, None] + near]
    found, alike = between(corners, (np.stack([column, row], axis=1) - low) / BLOCK)

    def color(open_to: NDArray[np.float64]) -> NDArray[np.floating]:
        return to_srgb((0.9 * LIGHT[1] * open_to[:, 1] + 0.45 * open_to[:, 0]) / (0.9 * LIGHT[1] + 0.45))

    truth, drawn = exact[row, column], picture[row, column, 0]
    expected = color(np.where(alike[:, None], found, truth))
    off = np.abs(drawn - expected)
    assert np.quantile(off, 0.99) < 2e-3
    assert off[alike].mean() < 0.2 * np.abs(drawn - color(truth))[alike].mean(), (
        "there the floor is interpolated, not evaluated"
    )
    assert 0.5 < alike.mean() < 0.95
    assert np.abs(drawn - color(truth)).max() < 0.03


def test_from_below_there_is_no_floor(ball: Renderer) -> None:
    camera = Camera(0, -40)
    softbox, phong = (
        ball.render((SIDE, SIDE), camera, RenderOptions(shade=shading)) for shading in ("softbox", "phong")
    )
    np.testing.assert_array_equal(softbox[..., 3], phong[..., 3])
    behind = phong[..., 3] == 0
    np.testing.assert_array_equal(softbox[behind], phong[behind])
    assert not np.array_equal(softbox, phong)
