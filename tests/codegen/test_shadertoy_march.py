"""Shadertoy texts march like the oracle in numpy, inside a hull, and lose no hit of dense marching."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.codegen.targets.orbit import AZIMUTH, ELEVATION
from mplicits.codegen.targets.shadertoy_text import savings, step_bound
from mplicits.field.digits import fewest_digits
from mplicits.field.half_widths import Grid, narrow_widths
from mplicits.field.hull import NORMALS, hull
from mplicits.field.interpret import field
from mplicits.field.surface_points import on_surface
from mplicits.ir.lower import lower
from mplicits.model.model import DELTA_FACTOR, Level, Model
from mplicits.trainer.shapes.demo import DemoShape
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from oracles.dense import dense_march
from oracles.march import half_widths, march
from oracles.short_march import STOP, short_march
from support.dense_views import VIEWS
from support.fitted_model import evaluate, fit
from support.random_model import random_model
from support.shadertoy import INPUTS, MAIN, SHADERTOY, demo, draw, literal_text

SIDE = 96
RADIUS = 0.7


COLORED = "o+=vec4(w,1);\n}\no=pow(o/o.a,vec4(.4545));"
"""The text that writes the color of a pixel."""


def drawn_square(osmesa: Context, text: str, side: int) -> NDArray[np.float32]:
    """Draw a text at time 0. Returns (side, side, 4), top row first."""
    inputs = {"iResolution": (side, side, 1), "iTime": 0.0, "iMouse": (0, 0, 0, 0), "iFrame": 0}
    return draw(osmesa, INPUTS + text + MAIN, (side, side), inputs)


def first_camera(model: Model) -> Camera:
    """Return a text's camera at time 0."""
    return Camera(*(model.front or (AZIMUTH, ELEVATION)), distance=3.52, fov=2 * math.degrees(math.atan(1 / 3.17)))


@pytest.fixture(scope="module")
def model() -> Model:
    return demo()


@pytest.fixture(scope="module")
def planes(model: Model) -> NDArray[np.float64]:
    return hull(lower(model))


@pytest.fixture(scope="module")
def narrow(model: Model) -> Grid:
    """Widths of level 1's band in 8^3 cells."""
    return narrow_widths(lower(model), 8)[0]


@pytest.mark.slow
def test_the_text_takes_the_steps_of_numpy(
    osmesa: Context, model: Model, planes: NDArray[np.float64], narrow: Grid
) -> None:
    text = literal_text(model, "phong")
    for old, new in (
        ("float t=0.", "float C=0.,t=0."),
        ("f=field(", "C+=float(k<0);f=field("),
        (COLORED, "o=vec4(t,C,k>3,1);\n}"),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    drawn = drawn_square(osmesa, text, SIDE).reshape(-1, 4)
    program = lower(model, fewest_digits(model))
    eye, directions, footprint = first_camera(model).rays(SIDE, SIDE)
    directions, bound = directions.reshape(-1, 3), step_bound(program)
    rays = short_march(program, eye, directions, footprint, bound, planes=planes, narrow=narrow)
    assert (rays.hit == (drawn[:, 2] > 0.5)).mean() > 0.998
    assert (rays.steps == drawn[:, 1]).mean() > 0.97, "steps may differ where rounding moves f across a threshold"
    both = rays.hit & (drawn[:, 2] > 0.5)
    assert np.median(np.abs(rays.t - drawn[:, 0])[both]) < 1e-3


def test_the_march_loses_no_hit_and_takes_two_thirds_of_the_work(
    model: Model, planes: NDArray[np.float64], narrow: Grid
) -> None:
    program = lower(model)
    costs = [program.cost(function).multiply_adds for function in program.values]
    for camera in VIEWS[:3]:
        eye, directions, footprint = camera.rays(SIDE, SIDE)
        directions = directions.reshape(-1, 3)
        closest, end = dense_march(program, eye, directions, 2, footprint)
        plain = march(program, eye, directions, 2, footprint)
        for around, widths in ((planes, narrow), (planes, None), (None, None)):
            rays = short_march(program, eye, directions, footprint, step_bound(program), planes=around, narrow=widths)
            assert not ((closest == 0) & (~rays.hit | (rays.t > end * (1 + footprint)))).any()
            trained = np.linalg.norm(eye + rays.t[:, None] * directions, axis=1) < 1
            assert not (rays.hit & trained & (closest > 1.05 * STOP)).any()
            share = 1.0 if around is None else 0.67 if widths is None else 0.6
            assert np.dot(rays.evaluations, costs) < share * np.dot(plain.evaluations, costs)


def test_the_hull_encloses_the_shape_closely(planes: NDArray[np.float64]) -> None:
    along = DemoShape().surface(20_000, np.random.default_rng(1)).points @ NORMALS.T
    assert (along >= planes[:, 0]).all()
    assert (along <= planes[:, 1]).all()
    room = np.stack([along.min(axis=0) - planes[:, 0], planes[:, 1] - along.max(axis=0)])
    assert (room / np.linalg.norm(NORMALS, axis=1)).max() < 0.2, "level 1 has a small component at the ball's border"


def test_the_surface_is_inside_the_narrow_bands(model: Model, narrow: Grid) -> None:
    program = lower(model)
    points = DemoShape().surface(20_000, np.random.default_rng(1)).points.astype(np.float32)
    points = on_surface(program, points)
    assert len(points) > 15_000
    sizes = np.abs(field(program, points, 1))
    for grid in (narrow_widths(program, 4)[0], narrow):
        widths, last = half_widths(program, (grid,), points)
        assert (sizes <= widths).all()
        assert widths.mean() < 0.8 * program.bands[0].delta
        assert (last == program.bands[1].delta).all()


def ball_of_narrow_band() -> Model:
    """Fit two levels to a ball: level 1's band is about as narrow as the taps of a normal are apart."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points = directions * rng.uniform(0.6, 1.0, (3000, 1))
    near = directions * rng.uniform(RADIUS - 0.01, RADIUS + 0.01, (3000, 1))
    first = fit(64, 1.0, points, np.linalg.norm(points, axis=1, keepdims=True) - RADIUS, rng)
    residual = np.linalg.norm(near, axis=1, keepdims=True) - RADIUS - evaluate(first, near)
    second = fit(64, 4.0, near, residual, rng)
    return Model("ball", (Level(first, DELTA_FACTOR * float(np.abs(residual).max()), 20), Level(second, 1e-3, 5)))


def test_no_step_between_the_taps_of_a_normal(osmesa: Context) -> None:
    """Where only some taps had left the band, smooth shapes had blots."""
    model = ball_of_narrow_band()
    assert 0.001 < model.levels[0].delta < 0.005
    text = literal_text(model, "phong")
    assert text.count(COLORED) == 1
    drawn = drawn_square(osmesa, text.replace(COLORED, "o=vec4(n,k>3);\n}"), 256)
    eye, directions, _ = first_camera(model).rays(256, 256)
    nearest = -directions @ eye
    half_chord_squared = RADIUS**2 - (eye @ eye - nearest**2)
    inner = half_chord_squared > 0.02
    assert (drawn[inner, 3] == 1).all()
    expected = eye + (nearest - np.sqrt(half_chord_squared.clip(0)))[..., None] * directions
    cosine = (drawn[inner, :3] * expected[inner]).sum(axis=-1) / RADIUS
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 2


def test_only_long_texts_have_a_hull_and_narrow_bands(model: Model, planes: NDArray[np.float64], narrow: Grid) -> None:
    text = literal_text(model, "phong")
    saved = savings(lower(model), len(text))
    np.testing.assert_array_equal(saved.planes, planes)
    np.testing.assert_array_equal(saved.narrow, narrow)
    assert "float[](" in text
    assert "float[](" not in SHADERTOY(random_model((8, 1), (8, 0)), "literal")
