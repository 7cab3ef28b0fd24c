"""The page's scripts compute the same as Python: the field's GLSL, schedule, uniforms, camera, cells and floor.

The scripts and constants run in one blank page in Chromium, without drawing.
"""

import base64
import itertools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mplicits.codegen.printers.field import print_field
from mplicits.codegen.targets import glsl330
from mplicits.codegen.targets.glsl300es import DIALECT
from mplicits.codegen.targets.shader import LOOP_LIMIT, Shader
from mplicits.codegen.targets.uniforms import SHADINGS, TIME, UNIFORMS, default
from mplicits.field import interpret
from mplicits.field.cells import Cells
from mplicits.field.lowest import lowest_point
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.model.model_file import Training, load, to_bytes
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.loop_limit import schedule_that_fits
from mplicits.web.bundle import modules, script
from mplicits.web.facts import CELL_MOMENTS, MANY, TOO_MANY, facts_json
from support.packed_model import packed_model
from support.paths import DEMO
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

MODELS = {
    "one level": random_model((12, 3)),
    "three levels, texture": random_model((16, 1), (18, 2), (64, 1), texture=(10, 1)),
    "packed, texture": packed_model(random_model((16, 1), (18, 2), texture=(10, 1))),
    "moving": random_model((5, 0), inputs="xyzt"),
    "moving, texture": random_model((8, 1), seed=7, texture=(3, 0), inputs="xyzt"),
    "a level wider than literals may be": random_model((16, 1), (80, 1)),
    "a texture wider than literals may be": random_model((9, 0), texture=(66, 1)),
    "33 blocks, whose loops are unrolled by 11": random_model((130, 1)),
    "31 blocks, whose loops are not unrolled": random_model((124, 1)),
}
ASK = """
const modelOf = (bytes) => parseModel(Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0)).buffer);
window.ask = {
    print: ([bytes, storage]) => {
        const {texels, ...rest} = printField(modelOf(bytes), storage);
        return {...rest, texels: [...texels]};
    },
    number: (values) => values.map(number),
    fit: (cases) => cases.map((values) => fitting(...values)),
    uniforms: (options) => {
        const bounds = {step_bound: 0.9, band_step_bound: 0.7};
        const model = {levels: [{delta: 0.1, iterations: 20, bounds}, {delta: 0.02, iterations: 5, bounds}]};
        return uniforms({model, camera: homeOf(null), options, cells: options.cells}, null, [300, 200]);
    },
    counts: (model) => countsOf(model),
    cells: async ([bytes, count]) => {
        const found = await emptyCells(modelOf(bytes), count, () => true, async () => {});
        const times = found.grids.map((_, k) => (k + 0.3) / found.grids.length);
        return {...found, grids: times.map((time) => [...gridOf(found, time)])};
    },
    lowest: (bytes) => lowestPoint(modelOf(bytes)),
    widened: ([bytes, points, margin]) => [...widenedValues(modelOf(bytes), points, 0, margin)],
    camera: ([hash, turn, factor, aspect]) => {
        const camera = zoomed(orbited(fromHash(hash, homeOf(null)), ...turn), factor, aspect);
        return [FOCAL, matrix(homeOf(null), aspect), matrix(camera, aspect)];
    },
};
null;
"""
Ask = Callable[[str, Any], Any]


def encoded(model: Model, training: Training | None = None) -> str:
    """Return a model's file in base64."""
    return base64.b64encode(to_bytes(model, training=training)).decode()


@pytest.fixture(scope="module")
def ask(browser: "Browser") -> Iterator[Ask]:
    """Return a function that calls a function of ASK with an argument."""
    page = browser.new_page()
    page.set_content(f'<!doctype html><script type="application/json" id="facts">{facts_json({})}</script>')
    page.evaluate(
        script(modules("safetensors.js", "field.js", "cells.js", "lowest_point.js", "camera.js", "uniforms.js")) + ASK
    )
    yield lambda name, value: page.evaluate("([name, value]) => window.ask[name](value)", [name, value])
    page.close()


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
@pytest.mark.parametrize("storage", ["texture", "literal", "auto"])
def test_the_page_prints_the_field_that_codegen_prints(ask: Ask, storage: str, model: Model) -> None:
    printed = ask("print", [encoded(model), storage])
    field = print_field(lower(model), DIALECT.language, storage, nested=True)
    assert printed["text"] == field.text
    weights = np.zeros((0, 1024, 4), np.float32) if field.weights is None else field.weights
    assert printed["height"] == len(weights)
    np.testing.assert_array_equal(np.asarray(printed["texels"], np.float32), weights.ravel())
    assert tuple(printed["loops"]["value"]) == field.value_loops
    assert tuple(printed["loops"]["gradient"]) == field.gradient_loops
    assert printed["loops"]["texture"] == field.texture_loops


def test_the_page_ignores_the_state_of_a_training(ask: Ask) -> None:
    model, printed = MODELS["one level"], []
    for training in (None, ("{}", {"order": np.arange(3, dtype=np.int64)})):
        printed.append(ask("print", [encoded(model, training), "literal"])["text"])
    assert printed[0] == printed[1]


def test_the_page_prints_the_numbers_that_codegen_prints(ask: Ask) -> None:
    """Weights may be of any size below a million, beyond which NumPy writes powers of ten, and 0 may have a sign."""
    rng = np.random.default_rng(0)
    values = rng.uniform(-1, 1, 3000) * 10.0 ** rng.integers(-37, 6, 3000)
    rounded = [round(value, digits) for value in rng.uniform(-20, 20, 100).tolist() for digits in range(6)]
    halves = np.arange(0x7C00, dtype=np.uint16).view(np.float16)
    edges = [-0.0, -1.0, 0.1, -0.5, 1e-4, 9.9999e-5, 1e-5, 100.0, 16384.5, 28381.3125, 999999.0]
    numbers = np.array([*values, *rounded, *halves, *edges, *0.5 ** np.arange(-19.0, 60)], np.float32).tolist()
    assert ask("number", numbers) == [DIALECT.language.number(number) for number in numbers]


def schedule(shader: Shader, level: int, normal_level: int, steps: tuple[int, ...], rounds: int) -> dict[str, Any]:
    """Return the desktop's schedule, or one round of the fewest steps if the desktop refuses."""
    try:
        fitting_steps, fitting_rounds = schedule_that_fits(shader, level, normal_level, steps, rounds, "relaxed")
    except UserError:
        fitting_steps, fitting_rounds = (*steps[: level - 1], min(steps[level - 1], 3), *steps[level:]), 1
    return {"steps": list(fitting_steps), "rounds": fitting_rounds}


def test_the_page_fits_its_schedule_to_the_loop_limit_of_llvmpipe(ask: Ask) -> None:
    shader = glsl330.bake(random_model((40, 1), (64, 2), texture=(8, 0)), "texture")
    loops = {"value": shader.value_loops, "gradient": shader.gradient_loops, "texture": shader.texture_loops}
    steps = [(20, 5), (60, 60), (200, 2), (2000, 2), (1, 1)]
    schedules = [*itertools.product((1, 2), (1, 2), steps, (1, 32, 1000))]
    excesses = [shader.worst_loops(*given, "relaxed") - LOOP_LIMIT for given in schedules]
    assert min(excesses) < 0 < max(excesses)
    assert ask("fit", [[loops, *given] for given in schedules]) == [schedule(shader, *given) for given in schedules]


@pytest.mark.parametrize(
    ("model", "count", "moments"),
    [(load(DEMO), 64, 1), (MODELS["one level"], 32, 1), (MODELS["moving"], 16, CELL_MOMENTS)],
    ids=["demo", "one level", "moving"],
)
def test_the_page_finds_the_cells_that_codegen_finds(ask: Ask, model: Model, count: int, moments: int) -> None:
    found = ask("cells", [encoded(model), count])
    cells = Cells(lower(model), count, moments)
    assert (found["count"], found["half"]) == (count, pytest.approx(cells.half))
    assert len(found["grids"]) == moments
    grids = np.stack([cells.grid((k + 0.3) / moments) for k in range(moments)])
    differ = np.asarray(found["grids"]).reshape(grids.shape) != grids
    assert differ.mean() < 1e-3, "rounding decides at some cells"


def test_the_page_finds_coarse_grids_and_then_a_fine_one(ask: Ask) -> None:
    models: dict[str, dict[str, Any]] = {
        "small": {"inputs": "xyz", "parameters": MANY, "field": None},
        "large": {"inputs": "xyz", "parameters": MANY + 1, "field": None},
        "larger": {"inputs": "xyz", "parameters": TOO_MANY + 1, "field": None},
        "moving": {"inputs": "xyzt", "parameters": 100, "field": None},
        "scene": {"inputs": "xyz", "parameters": 100, "field": {}},
    }
    counts = {name: ask("counts", facts) for name, facts in models.items()}
    assert counts == {"small": [32, 128], "large": [32, 64, 128], "larger": [32, 64], "moving": [32], "scene": []}


def test_the_page_finds_the_floor_that_codegen_finds(ask: Ask) -> None:
    assert ask("lowest", encoded(load(DEMO))) == pytest.approx(lowest_point(lower(load(DEMO))), abs=5e-3)


def test_the_page_s_widened_bands_are_the_reference_s(ask: Ask) -> None:
    program, margin = lower(load(DEMO)), 0.01
    points = np.random.default_rng(3).uniform(-1, 1, (4000, 3)).astype(np.float32)
    expected = interpret.field(program, points, 1)
    inside = np.abs(expected) < program.bands[0].delta + margin
    assert 0.02 < inside.mean() < 0.5
    expected[inside] = interpret.field(program, points[inside], 2)
    values = ask("widened", [encoded(load(DEMO)), points.tolist(), margin])
    np.testing.assert_allclose(values, expected, atol=1e-5)


def test_the_page_sets_every_uniform_of_the_table(ask: Ask) -> None:
    options = {"level": 2, "normalLevel": None, "iterations": 1, "time": 0, "light": [0, 0, 1]}
    for value, shading in enumerate(SHADINGS):
        values = ask("uniforms", {**options, "shading": shading, "background": [[0, 0, 0], [1, 1, 1]]})
        assert values["shading"] == value
    names = {uniform.name for uniform in (*UNIFORMS, TIME)} | {"skips", "newton"}
    assert set(values) == names - {"origin"}, "the painter sets a tile's origin"
    assert (values["step_bound"], values["band_step_bound"]) == ([0.9, 0.9], [0.7, 0.7])
    assert (values["rounds"], values["step_scale"]) == (*default("rounds"), list(default("step_scale")))


@pytest.mark.parametrize(
    ("level", "normals", "count", "skips", "newton"),
    [(2, None, 128, 1, 1), (2, 2, 128, 1, 1), (2, 1, 128, 1, 0), (1, 1, 128, 0, 0), (2, None, 0, 0, 0)],
)
def test_rays_take_newton_s_step_where_the_grid_and_the_normals_are_of_the_last_level(
    ask: Ask, level: int, normals: int | None, count: int, skips: int, newton: int
) -> None:
    options = {"level": level, "normalLevel": normals, "iterations": 1, "time": 0, "light": [0, 0, 1]}
    cells = {"count": count, "half": 1.1} if count else None
    values = ask("uniforms", {**options, "shading": "phong", "background": [[0, 0, 0], [1, 1, 1]], "cells": cells})
    assert (values["skips"], values["newton"]) == (skips, newton)


@pytest.mark.parametrize(
    ("hash_", "turn", "factor", "camera"),
    [
        ("", (0, 0), 1, Camera()),
        ("#az=200&el=-35&d=2.6", (0, 0), 1, Camera(200, -35, 2.6)),
        ("#az=350&el=80&d=3&at=0.1,-0.2,0.3", (20, 20), 2, Camera(10, 90, 6, (0.1, -0.2, 0.3))),
        ("#az=1&el=2&d=3", (0, 0), 1e-6, Camera(1, 2, 3).zoomed(1e-6)),
        ("#az=1&el=2&d=3", (0, 0), 1e6, Camera(1, 2, 3).zoomed(1e6)),
        ("#az=1000&el=100&d=1000&at=1000,0,0", (0, 0), 1, Camera()),
    ],
    ids=["default", "hash", "turned, zoomed", "nearest", "farthest", "out of range"],
)
@pytest.mark.parametrize("aspect", [1.5, 0.5])
def test_the_page_s_camera_is_the_desktop_s(
    ask: Ask, aspect: float, hash_: str, turn: tuple[float, float], factor: float, camera: Camera
) -> None:
    focal, first, changed = ask("camera", [hash_, turn, factor, aspect])
    assert focal == pytest.approx(camera.focal)
    home = Camera(aspect=aspect)
    np.testing.assert_allclose(np.reshape(first, (4, 4)).T, home.matrix(), atol=1e-6)
    fitted = home if camera.distance is None else camera
    np.testing.assert_allclose(np.reshape(changed, (4, 4)).T, fitted.matrix(), rtol=1e-6, atol=1e-6)
