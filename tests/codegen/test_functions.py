"""Functions alone compute what the numpy reference does, in every language, and two of them live in one program."""

import importlib.util
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.ir.lower import lower
from mplicits.field import interpret
from mplicits.codegen.targets.function_target import function_name
from mplicits.codegen.targets.header import read_header
from mplicits.bake.registry import TARGETS
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.model.orientation import as_in_file
from mplicits.viewer.draw.compile import VERTEX_SHADER
from mplicits.viewer.draw.context import Context
from support.random_model import random_model
from support.scene_models import SCENE, composed

Array = NDArray[np.float32]
ALONE = [name for name, target in TARGETS.items() if target.alone]
COUNT = 4096
LEVELS = 3
MODEL = replace(
    random_model((16, 1), (18, 2), (12, 0), texture=(10, 1)), centre=(0.5, -2.0, 1.0), scale=3.0, up="z", name="Model"
)
OTHER = random_model((8, 1), name="other", seed=1)
TIME = 0.6
CASES = {
    "model": (MODEL, "model", ""),
    "input": (MODEL, "input", ""),
    "moving": (random_model((16, 1), (12, 1), texture=(8, 0), inputs="xyzt", name="model"), "model", ", time"),
}
"""Case -> model, space, and what its functions take after the point."""


def points(model: Model) -> Array:
    """COUNT points of model space, none of them where rounding decides on a level."""
    here = np.random.default_rng(4).uniform(-1, 1, (2 * COUNT, 3)).astype(np.float32)
    edges = np.zeros(len(here), np.bool_)
    for level, entry in enumerate(model.levels[:-1], start=1):
        edges |= np.abs(np.abs(interpret.field(lower(model), here, level, TIME)) - entry.delta) < 1e-4
    steep = np.linalg.norm(gradient(model, here), axis=1) > 0.1
    clear: Array = here[~edges & steep]
    return clear[:COUNT]


def gradient(model: Model, here: Array) -> Array:
    """The gradient of the finest level that is defined at points of model space, (N, 3)."""
    program = lower(model)
    _, reached = interpret.nested_field(program, here, len(model.levels), TIME)
    every = [interpret.field_gradient(program, here, level, TIME)[0] for level in range(1, len(model.levels) + 1)]
    return np.asarray(np.stack(every)[reached - 1, np.arange(len(here))])


def in_space(model: Model, space: str, here: Array) -> Array:
    """Points of model space, as a function in a space takes them."""
    if space == "model":
        return here
    placed: Array = as_in_file(here.astype(np.float64) * model.scale + model.centre, model.up).astype(np.float32)
    return placed


def expected(model: Model, space: str, here: Array) -> Array:
    """What every language must give, (N, 8): the field, level 1's, the normal, the colour."""
    program = lower(model)
    scale = model.scale if space == "input" else 1.0
    whole, _ = interpret.nested_field(program, here, len(model.levels), TIME)
    normal = gradient(model, here)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    if space == "input":
        normal = as_in_file(normal.astype(np.float64), model.up).astype(np.float32)
    first = interpret.field(program, here, 1, TIME)
    return np.column_stack([scale * whole, scale * first, normal, interpret.colour(program, here, TIME)])


def body(vec3: str, time: str) -> str:
    """Statements in a shader's language that fill `a` and `b`, two vectors of four, at a point p."""
    call = f"(p{time})"
    return (
        f"n = model_normal{call}; c = model_color{call};"
        f"a = FOUR(model{call}, model_level(p, 1{time}), n.x, n.y); b = FOUR(n.z, c.x, c.y, c.z);"
        f"a.x += 0. * other({vec3}(.1, .2, .3));"
    )


def in_glsl(texts: str, here: Array, time: str, _: Path, osmesa: Context) -> Array:
    main = f"""
uniform sampler2D points; uniform int half_; out vec4 color;
void main() {{
    vec3 p = texelFetch(points, ivec2(gl_FragCoord.xy), 0).xyz, n, c; vec4 a, b; float time = {TIME};
    {body("vec3", time).replace("FOUR", "vec4")}
    color = half_ == 0 ? a : b;
}}"""
    with osmesa as gl:
        program = gl.program(vertex_shader=VERTEX_SHADER, fragment_shader="#version 330\n" + texts + main)
        texels = np.concatenate([here, here[:, :1]], axis=1).tobytes()
        gl.texture((64, 64), 4, texels, dtype="f4").use(0)
        target, results = gl.framebuffer([gl.texture((64, 64), 4, dtype="f4")]), []
        for half in (0, 1):
            program["half_"] = half
            target.use()
            gl.vertex_array(program, []).render(vertices=3)
            results.append(np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(-1, 4))
    return np.concatenate(results, axis=1)


def computed(shader: Any, here: Array) -> Array:
    """Run a compute shader of WebGPU, WGSL or SPIR-V, on points; skips where there is no adapter."""
    compute = pytest.importorskip("wgpu.utils.compute", reason="wgpu is not installed (pip: wgpu-shadertoy)")
    try:
        out = compute.compute_with_buffers(
            {0: np.ascontiguousarray(here)}, {1: (8 * COUNT, "f")}, shader, n=(COUNT // 64, 1, 1)
        )
    except RuntimeError as error:
        if "adapter" in str(error).lower():
            pytest.skip("no Vulkan driver (Debian: mesa-vulkan-drivers)")
        raise
    return np.frombuffer(out[1], np.float32).reshape(COUNT, 8)


def in_wgsl(texts: str, here: Array, time: str, *_: object) -> Array:
    main = f"""
@group(0) @binding(0) var<storage, read> points: array<f32>;
@group(0) @binding(1) var<storage, read_write> results: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) at: vec3u) {{
    let i = at.x; let p = vec3f(points[3 * i], points[3 * i + 1], points[3 * i + 2]); let time = f32({TIME});
    var n: vec3f; var c: vec3f; var a: vec4f; var b: vec4f;
    {body("vec3f", time).replace("FOUR", "vec4f")}
    for (var k = 0u; k < 4u; k++) {{ results[8 * i + k] = a[k]; results[8 * i + 4 + k] = b[k]; }}
}}"""
    return computed(texts + main, here)


def in_hlsl(texts: str, here: Array, time: str, folder: Path, _: Context) -> Array:
    if shutil.which("glslangValidator") is None:
        pytest.skip("glslangValidator is not installed (Debian: glslang-tools)")
    main = f"""
[[vk::binding(0, 0)]] StructuredBuffer<float> points;
[[vk::binding(1, 0)]] RWStructuredBuffer<float> results;
[numthreads(64, 1, 1)] void main(uint3 at : SV_DispatchThreadID) {{
    uint i = at.x; float3 p = float3(points[3 * i], points[3 * i + 1], points[3 * i + 2]), n, c; float4 a, b;
    float time = {TIME};
    {body("float3", time).replace("FOUR", "float4")}
    for (uint k = 0; k < 4; k++) {{ results[8 * i + k] = a[k]; results[8 * i + 4 + k] = b[k]; }}
}}"""
    source, output = folder / "f.hlsl", folder / "f.spv"
    source.write_text(texts + main)
    command = ["glslangValidator", "-D", "-V", "-e", "main", "-S", "comp", str(source), "-o", str(output)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    return computed(output.read_bytes(), here)


def in_c(texts: str, here: Array, time: str, folder: Path, _: Context) -> Array:
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    main = f"""
#include <stdio.h>
int main(void) {{
    float p[3], r[8], q[3] = {{.1f, .2f, .3f}}, time = {TIME}f;
    while (fread(p, 4, 3, stdin) == 3) {{
        (void)time;
        r[0] = model(p{time}) + 0.f * other(q); r[1] = model_level(p, 1{time});
        model_normal(p{time}, r + 2); model_color(p{time}, r + 5);
        fwrite(r, 4, 8, stdout);
    }}
    return 0;
}}"""
    source, program = folder / "f.c", folder / "f"
    source.write_text(texts + main)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1"]
    subprocess.run(["gcc", *strict, str(source), "-o", str(program), "-lm"], check=True)
    done = subprocess.run([str(program)], input=here.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.float32).reshape(-1, 8)


def in_python(texts: str, here: Array, time: str, folder: Path, _: Context) -> Array:
    path = folder / "alone.py"
    path.write_text(texts)
    spec = importlib.util.spec_from_file_location("alone", path)
    assert spec is not None
    assert spec.loader is not None
    alone: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(alone)
    more = [TIME] if time else []
    grid = here.reshape(64, 64, 3)
    assert alone.other([0, 0, 0]).shape == ()
    parts = [
        *(alone.model(grid, *more)[..., None], alone.model_level(grid, 1, *more)[..., None]),
        *(alone.model_normal(grid, *more), alone.model_color(grid, *more)),
    ]
    return np.asarray(np.concatenate(parts, axis=-1).reshape(-1, 8), np.float32)


RUNNERS: dict[str, Callable[[str, Array, str, Path, Context], Array]] = {
    "glsl": in_glsl,
    "wgsl": in_wgsl,
    "hlsl": in_hlsl,
    "c": in_c,
    "python": in_python,
}


def test_every_function_has_a_language_to_run_in() -> None:
    assert list(RUNNERS) == ALONE


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("target", ALONE)
def test_a_function_alone_equals_the_reference(target: str, case: str, osmesa: Context, tmp_path: Path) -> None:
    model, space, time = CASES[case]
    texts = "".join(
        TARGETS[target](entry, name=name, space=space) for entry, name in ((model, "model"), (OTHER, "other"))
    )
    here = points(model)
    assert len(here) == COUNT
    given = in_space(model, space, here)
    result, wanted = RUNNERS[target](texts, given, time, tmp_path, osmesa), expected(model, space, here)
    unit = model.scale if space == "input" else 1.0
    np.testing.assert_allclose(result[:, :2] / unit, wanted[:, :2] / unit, rtol=0, atol=1e-5)
    np.testing.assert_allclose(result[:, 2:5], wanted[:, 2:5], rtol=0, atol=1e-4)
    np.testing.assert_allclose(result[:, 5:], wanted[:, 5:], rtol=0, atol=1e-5)


@pytest.mark.parametrize("target", ALONE)
def test_a_scene_alone_equals_the_reference(target: str, osmesa: Context, tmp_path: Path) -> None:
    model = composed(tmp_path, SCENE, widths=(8, 12))
    here = points(model)
    text = TARGETS[target](model, name="model", space="input") + TARGETS[target](OTHER, name="other")
    result = RUNNERS[target](text, in_space(model, "input", here), ", time", tmp_path, osmesa)
    wanted = expected(model, "input", here)
    assert len({tuple(colour) for colour in np.round(wanted[:, 5:], 2)}) > 20
    apart = np.abs(result - wanted)
    for columns, tolerance in ((slice(0, 2), 1e-5 * model.scale), (slice(2, 5), 1e-3), (slice(5, 8), 1e-4)):
        far = apart[:, columns].max(axis=1) > tolerance
        assert far.mean() < 2e-3, "where two shapes are equally far, rounding decides"


def globals_of(text: str) -> Iterator[str]:
    """The first word of each line at the margin that is no comment, brace or type: what a text declares."""
    for line in text.splitlines():
        if line[:1].isalpha() or line[:1] == "_":
            head = line.split("=")[0].split("(")[0].split("[")[0].split(":")[0]
            yield head.split()[-1]


@pytest.mark.parametrize("target", ALONE)
def test_all_that_is_global_begins_with_the_name(target: str) -> None:
    text = TARGETS[target](MODEL, name="ox")
    names = set(globals_of(text)) - {"np"}
    assert {"ox", "ox_level", "ox_normal", "ox_color"} <= names
    assert not [name for name in names if not name.lstrip("_").startswith("ox")]


@pytest.mark.parametrize("target", ALONE)
def test_hostile_names_stay_in_the_comment(target: str) -> None:
    hostile = 'a "name" */??/\n\u2028</script>\\'
    text = TARGETS[target](random_model((4, 0), name=hostile))
    facts = read_header(text.replace("# {", "// {", 1))
    assert (facts["name"], facts["target"], facts["function"]) == (hostile, target, "a_name_script")
    assert "script>" not in text.split("\n", 1)[1]


@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("Stanford Bunny.ply", "stanford_bunny_ply"),
        ("float", "float_sdf"),
        ("3", "sdf_3"),
        ("☃", "sdf"),
        ("vec3", "vec3_sdf"),
    ],
)
def test_a_name_is_made_of_the_model_s(name: str, made: str) -> None:
    assert function_name(None, name, "glsl") == made


@pytest.mark.parametrize("name", ["", "3d", "a b", "a__b", "a_", "float", "é", "x" * 41, "a;"])
def test_what_is_no_name_is_refused(name: str) -> None:
    with pytest.raises(UserError, match="--name"):
        function_name(name, "model", "glsl")


def test_what_does_not_fit_is_refused() -> None:
    wide = random_model((136, 0))
    for target in ("glsl", "wgsl", "hlsl"):
        with pytest.raises(UserError, match="136 wide is too large"):
            TARGETS[target](wide)
    assert "_w1_0" in TARGETS["c"](wide)
    for options, said in (({"storage": "texture"}, "--storage texture"), ({"space": "world"}, "--space world")):
        with pytest.raises(UserError, match=said):
            TARGETS["glsl"](MODEL, **options)  # type: ignore[arg-type]
    with pytest.raises(UserError, match="--name: only functions alone have one: glsl, wgsl, hlsl, c, python"):
        TARGETS["glsl330"](MODEL, name="ox")
