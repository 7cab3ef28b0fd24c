"""The targets that emit only functions compute the numpy reference's field, and two such texts join in one program."""

import importlib.util
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets.function_target import function_name
from mplicits.codegen.targets.header import read_header
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.model.orientation import as_in_file
from mplicits.viewer.draw.context import Context
from support.function_runners import COUNT, TIME, in_c, in_glsl, in_hlsl, in_wgsl
from support.random_model import random_model
from support.scene_models import SCENE, composed

Array = NDArray[np.float32]
FUNCTION_TARGETS = [name for name, target in TARGETS.items() if target.function]
MODEL = replace(
    random_model((16, 1), (18, 2), (12, 0), texture=(10, 1)), center=(0.5, -2.0, 1.0), scale=3.0, up="z", name="Model"
)
OTHER = random_model((8, 1), name="other", seed=1)
CASES = {
    "model": (MODEL, "model", ""),
    "input": (MODEL, "input", ""),
    "moving": (random_model((16, 1), (12, 1), texture=(8, 0), inputs="xyzt", name="model"), "model", ", time"),
}
"""Case -> model, space, and the functions' arguments after the point."""


@cache
def reference(model: Model, space: str) -> tuple[Array, Array]:
    """Return COUNT points, (COUNT, 3), in a space, and the expected results, (COUNT, 8): field, level 1, normal, color.

    No point is where rounding decides on a level.
    """
    program, levels = lower(model), range(1, len(model.levels) + 1)
    points = np.random.default_rng(4).uniform(-1, 1, (2 * COUNT, 3)).astype(np.float32)
    field, reached = interpret.nested_field(program, points, len(levels), TIME)
    gradients, values = zip(*(interpret.field_gradient(program, points, level, TIME) for level in levels), strict=True)
    gradient = np.stack(gradients)[reached - 1, np.arange(len(points))]
    clear = np.linalg.norm(gradient, axis=1) > 0.1
    for value, level in zip(values, model.levels[:-1], strict=False):
        clear &= np.abs(np.abs(value) - level.delta) >= 1e-4
    scale = model.scale if space == "input" else 1.0
    normal = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    columns = [scale * field, scale * values[0], normal, interpret.color(program, points, TIME)]
    if space == "input":
        points = as_in_file(points.astype(np.float64) * model.scale + model.center, model.up).astype(np.float32)
        columns[2] = as_in_file(normal.astype(np.float64), model.up)
    return points[clear][:COUNT], np.column_stack(columns)[clear][:COUNT].astype(np.float32)


def body(vec3: str, time: str) -> str:
    """Return statements that fill the vectors `a` and `b` (4 components) at a point p, in a shader's language."""
    call = f"(p{time})"
    return (
        f"n = model_normal{call}; c = model_color{call};"
        f"a = FOUR(model{call}, model_level(p, 1{time}), n.x, n.y); b = FOUR(n.z, c.x, c.y, c.z);"
        f"a.x += 0. * other({vec3}(.1, .2, .3));"
    )


def in_python(texts: str, time: str, points: Array, folder: Path, _: Context) -> Array:
    path = folder / "module.py"
    path.write_text(texts)
    spec = importlib.util.spec_from_file_location("module", path)
    assert spec is not None
    assert spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    more = [TIME] if time else []
    grid = points.reshape(64, 64, 3)
    assert module.other([0, 0, 0]).shape == ()
    parts = [
        *(module.model(grid, *more)[..., None], module.model_level(grid, 1, *more)[..., None]),
        *(module.model_normal(grid, *more), module.model_color(grid, *more)),
    ]
    return np.asarray(np.concatenate(parts, axis=-1).reshape(-1, 8), np.float32)


def in_c_program(texts: str, time: str, *more: Any) -> Array:
    statements = (
        f"float q[3] = {{.1f, .2f, .3f}}; r[0] = model(p{time}) + 0.f * other(q); r[1] = model_level(p, 1{time});"
        f"model_normal(p{time}, r + 2); model_color(p{time}, r + 5);"
    )
    return in_c(texts, statements, *more)


RUNNERS: dict[str, Callable[..., Array]] = {
    "glsl": lambda texts, time, *more: in_glsl(texts, body("vec3", time), *more),
    "wgsl": lambda texts, time, *more: in_wgsl(texts, body("vec3f", time), *more),
    "hlsl": lambda texts, time, *more: in_hlsl(texts, body("float3", time), *more),
    "c": in_c_program,
    "python": in_python,
}


def test_every_function_target_has_a_runner() -> None:
    assert list(RUNNERS) == FUNCTION_TARGETS


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("target", FUNCTION_TARGETS)
def test_functions_of_a_shape_equal_the_reference(target: str, case: str, osmesa: Context, tmp_path: Path) -> None:
    model, space, time = CASES[case]
    texts = TARGETS[target](model, name="model", space=space) + TARGETS[target](OTHER, name="other", space=space)
    points, expected = reference(model, space)
    assert len(points) == COUNT
    result = RUNNERS[target](texts, time, points, tmp_path, osmesa)
    unit = model.scale if space == "input" else 1.0
    np.testing.assert_allclose(result[:, :2] / unit, expected[:, :2] / unit, rtol=0, atol=1e-5)
    np.testing.assert_allclose(result[:, 2:5], expected[:, 2:5], rtol=0, atol=1e-4)
    np.testing.assert_allclose(result[:, 5:], expected[:, 5:], rtol=0, atol=1e-5)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return composed(tmp_path_factory.mktemp("scene"), SCENE, widths=(8, 12))


@pytest.mark.parametrize("target", FUNCTION_TARGETS)
def test_functions_of_a_scene_equal_the_reference(target: str, scene: Model, osmesa: Context, tmp_path: Path) -> None:
    points, expected = reference(scene, "input")
    text = TARGETS[target](scene, name="model", space="input") + TARGETS[target](OTHER, name="other")
    result = RUNNERS[target](text, ", time", points, tmp_path, osmesa)
    assert len({tuple(color) for color in np.round(expected[:, 5:], 2)}) > 20
    apart = np.abs(result - expected)
    unit = scene.scale
    for columns, tolerance, most in (
        (slice(2), 1e-5 * unit, 2e-4),
        (slice(2, 5), 1e-3, 2e-3),
        (slice(5, 8), 1e-4, 2e-3),
    ):
        far = apart[:, columns].max(axis=1) > tolerance
        assert far.mean() < most, "for normals and colors, rounding decides where two shapes are equally far"


def globals_of(text: str) -> Iterator[str]:
    """Yield the global names that a text declares: the last word before (, [, = or : of each line at the margin."""
    for line in text.splitlines():
        if line[:1].isalpha() or line[:1] == "_":
            head = line.split("=")[0].split("(")[0].split("[")[0].split(":")[0]
            yield head.split()[-1]


@pytest.mark.parametrize("target", FUNCTION_TARGETS)
def test_every_global_name_begins_with_the_function_s(target: str) -> None:
    names = set(globals_of(TARGETS[target](MODEL, name="ox"))) - {"np"}
    assert {"ox", "ox_level", "ox_normal", "ox_color"} <= names
    assert not [name for name in names if not name.lstrip("_").startswith("ox")]


@pytest.mark.parametrize("target", FUNCTION_TARGETS)
def test_a_hostile_model_name_stays_in_the_comment(target: str) -> None:
    hostile = 'a "name" */??/\n\u2028</script>\\'
    text = TARGETS[target](random_model((4, 0), name=hostile))
    facts = read_header(text.replace("# {", "// {", 1))
    assert (facts["name"], facts["target"], facts["function"]) == (hostile, target, "a_name_script")
    assert "script>" not in text.split("\n", 1)[1]


@pytest.mark.parametrize(
    ("model_name", "name"),
    [("Stanford Bunny.ply", "stanford_bunny_ply"), ("float", "float_sdf"), ("3", "sdf_3"), ("☃", "sdf")],
)
def test_the_default_name_follows_the_model_s(model_name: str, name: str) -> None:
    assert function_name(None, model_name, "glsl") == name


@pytest.mark.parametrize("name", ["", "3d", "a b", "a__b", "a_", "é", "x" * 41, "a;"])
def test_a_name_that_is_no_identifier_is_refused(name: str) -> None:
    with pytest.raises(UserError, match="--name"):
        function_name(name, "model", "glsl")


def test_wide_models_and_wrong_options_are_refused() -> None:
    wide = random_model((136, 0))
    for target in ("glsl", "wgsl", "hlsl"):
        with pytest.raises(UserError, match="136 wide is too large"):
            TARGETS[target](wide)
    assert "_w1_0" in TARGETS["c"](wide)
    for options, message in (({"storage": "texture"}, "--storage texture"), ({"space": "world"}, "--space world")):
        with pytest.raises(UserError, match=message):
            TARGETS["glsl"](MODEL, **options)
    with pytest.raises(UserError, match="--name: only these targets take it: glsl, wgsl, hlsl, c, python"):
        TARGETS["glsl330"](MODEL, name="ox")
