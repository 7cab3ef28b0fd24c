"""Target glsl330: a complete desktop fragment shader, GL 3.3 core."""

import base64
import json
from importlib.metadata import PackageNotFoundError, version

import numpy as np

import glsl

from .cstyle import Language
from .field import print_field
from .lower import lower
from .model import Model, shape_of
from .program import Array, Program
from .shader import Shader

LANGUAGE = Language()

UNIFORMS = (
    ("vec2", "resolution", "vec2(512)", "size of the image, pixels; the one to set"),
    ("vec2", "origin", "vec2(0)", "of this tile inside the image, pixels"),
    ("vec2", "jitter", "vec2(0)", "of the sample inside its pixel, pixels, [-0.5, 0.5)"),
    ("mat4", "camera", "mat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3.4, 1)",
     "camera to model space: columns right, up, back, eye"),
    ("float", "focal", "2.75", "1 / tan(fov / 2), vertical"),
    ("int", "level", "LEVELS", "level that is traced"),
    ("int", "normal_level", "LEVELS", "level whose gradient is the normal"),
    ("int", "iterations[LEVELS]", None, "sphere tracing steps at each level, per round"),
    ("int", "rounds", "32", "how often the levels are gone through"),
    ("float", "delta[LEVELS]", None, "half width of each level's band, model units"),
    ("float", "step_scale", "0.8", "factor on every step: a trained gradient is in places longer than 1"),
    ("int", "shading", "0", "0 Phong, 1 normal, 2 depth, 3 steps, 4 texture, 5 data: (t, steps, level, hit)"),
    ("vec3", "light", "vec3(-0.5, 0.7, 0.8)", "direction to the light, camera space"),
    ("vec3", "background_bottom", "vec3(0.13, 0.14, 0.17)", "sRGB"),
    ("vec3", "background_top", "vec3(0.33, 0.36, 0.41)", "sRGB"),
)


def bake(model: Model, storage: str = "auto", digits: int | None = None, main: str = "main.glsl") -> Shader:
    """The fragment shader of `model`.

    storage: "literal", "texture", or "auto" by the table in field.py; digits: decimals of the weights, None for all;
    main: the file in glsl/ that follows the field, or its text.
    """
    program = lower(model, digits)
    field = print_field(program, LANGUAGE, storage)
    arrays = {
        "iterations[LEVELS]": f"int[]({', '.join(str(band.iterations) for band in program.bands)})",
        "delta[LEVELS]": f"float[]({', '.join(LANGUAGE.number(band.delta) for band in program.bands)})",
    }
    uniforms = [
        f"uniform {kind} {name} = {default or arrays[name]}; // {what}" for kind, name, default, what in UNIFORMS
    ]
    if program.moving:
        uniforms.append("uniform float time = 0.; // fourth input of the field")
    if field.weights is not None:
        height, width, _ = field.weights.shape
        uniforms.append(f"uniform sampler2D weights; // {width} x {height} RGBA32F; see `weights` at the end")
    text = "\n".join([
        "#version 330 core",
        *_head(model, program, "glsl330"),
        "",
        f"const int LEVELS = {len(program.bands)};",
        *uniforms,
        "out vec4 color;",
        "",
        field.text,
        glsl.load(main) if main.endswith(".glsl") else main,
    ])
    return Shader(
        text=text, weights=field.weights, value_loops=field.value_loops, gradient_loops=field.gradient_loops,
        texture_loops=field.texture_loops, iterations=tuple(band.iterations for band in program.bands),
        deltas=tuple(band.delta for band in program.bands),
    )


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """The shader as one file; a weight texture follows as comment lines in base64."""
    shader = bake(model, storage, digits)
    return shader.text + ("" if shader.weights is None else _weights_comment(shader.weights))


def _head(model: Model, program: Program, target: str) -> list[str]:
    """Comment lines. JSON escapes the name, which comes from anywhere: one line, ASCII, no backslash at its end."""
    levels = " > ".join(shape_of(level.network) for level in model.levels)
    return [
        f"// Multiscale neural signed distance function {json.dumps(program.name)}, levels {levels}",
        f"// model {program.sha256[:12]}, target {target}, mplicits {installed_version()}",
        "// Model space: the shape fits the unit sphere. Every uniform has a default; draw a triangle over the image.",
    ]


def installed_version() -> str:
    """Of this package."""
    try:
        return version("mplicits")
    except PackageNotFoundError:
        return "(not installed)"


def _weights_comment(weights: Array) -> str:
    data = base64.b64encode(weights.astype("<f4").tobytes()).decode()
    height, width, _ = weights.shape
    lines = [data[i : i + 116] for i in range(0, len(data), 116)]
    return (
        f"\n// weights: {width} x {height} RGBA32F, little-endian float32, rows in order, base64:\n"
        + "".join(f"// {line}\n" for line in lines)
    )


def read_weights(text: str) -> Array | None:
    """The weight texture (H, W, 4) that `standalone` appended to a shader, or None."""
    _, found, data = text.rpartition("\n// weights: ")
    if not found:
        return None
    size, *lines = data.splitlines()
    width, height = int(size.split()[0]), int(size.split()[2])
    values = np.frombuffer(base64.b64decode("".join(line.removeprefix("// ") for line in lines)), "<f4")
    return values.reshape(height, width, 4).astype(np.float32)
