"""A complete fragment shader from a model: what the GLSL targets share. A Dialect is what differs between them."""

import base64
import json
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

from ... import glsl
from ...model.model import Model, shape_of
from ..ir.lower import lower
from ..ir.program import Array, Program
from ..printers.cstyle import Language
from ..printers.field import print_field
from .shader import Shader

UNIFORMS = (
    ("vec2", "resolution", "vec2(512)", "size of the image, pixels; the one to set"),
    ("vec2", "origin", "vec2(0)", "of this tile inside the image, pixels"),
    ("vec2", "jitter", "vec2(0)", "of the sample inside its pixel, pixels, [-0.5, 0.5)"),
    (
        "mat4",
        "camera",
        "mat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3.4, 1)",
        "camera to model space: columns right, up, back, eye",
    ),
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


@dataclass(frozen=True)
class Dialect:
    """A GLSL version. opening: lines before the head; uniform: how one is declared; advice: the head's last line;
    helpers: text that the field's code calls.
    """

    target: str
    language: Language
    opening: tuple[str, ...]
    uniform: str
    advice: str
    helpers: str = ""


def bake(model: Model, dialect: Dialect, storage: str, digits: int | None, main: str) -> Shader:
    """The fragment shader of `model`.

    storage: "literal", "texture", or "auto" by the table in field.py; digits: decimals of the weights, None for all;
    main: the file in glsl/ that follows the field, or its text.
    """
    program = lower(model, digits)
    field = print_field(program, dialect.language, storage)
    text = "\n".join(
        [
            prologue(model, program, dialect, field.weights),
            field.text,
            glsl.load(main) if main.endswith(".glsl") else main,
        ]
    )
    return Shader(
        text=text,
        weights=field.weights,
        value_loops=field.value_loops,
        gradient_loops=field.gradient_loops,
        texture_loops=field.texture_loops,
        iterations=tuple(band.iterations for band in program.bands),
        deltas=tuple(band.delta for band in program.bands),
    )


def prologue(model: Model, program: Program, dialect: Dialect, weights: Array | None) -> str:
    """The text before the field: opening, head, uniforms, output."""
    language = dialect.language
    arrays = {
        "iterations[LEVELS]": f"int[]({', '.join(str(band.iterations) for band in program.bands)})",
        "delta[LEVELS]": f"float[]({', '.join(language.number(band.delta) for band in program.bands)})",
    }
    uniforms = [
        dialect.uniform.format(type=kind, name=name, default=default or arrays[name], what=what)
        for kind, name, default, what in UNIFORMS
    ]
    if program.moving:
        time = dialect.uniform.format(type="float", name="time", default="0.", what="fourth input of the field")
        uniforms.append(time)
    if weights is not None:
        height, width, _ = weights.shape
        uniforms.append(f"uniform sampler2D weights; // {width} x {height} RGBA32F; see `weights` at the end")
    return (
        "\n".join(
            [
                *dialect.opening,
                *_head(model, program, dialect),
                "",
                f"const int LEVELS = {len(program.bands)};",
                *uniforms,
                "out vec4 color;",
                "",
            ]
        )
        + dialect.helpers
    )


def with_weights(shader: Shader) -> str:
    """The shader as one file; a weight texture follows as comment lines in base64."""
    return shader.text + ("" if shader.weights is None else _weights_comment(shader.weights))


def installed_version() -> str:
    """The version of mplicits that shader text and pages name."""
    try:
        return version("mplicits")
    except PackageNotFoundError:
        return "(not installed)"


def _head(model: Model, program: Program, dialect: Dialect) -> list[str]:
    """Comment lines. JSON escapes the name, which comes from anywhere: one line, ASCII, no backslash at its end."""
    levels = " > ".join(shape_of(level.network) for level in model.levels)
    return [
        f"// Multiscale neural signed distance function {json.dumps(program.name)}, levels {levels}",
        f"// model {program.sha256[:12]}, target {dialect.target}, mplicits {installed_version()}",
        f"// Model space: the shape fits the unit sphere. {dialect.advice}",
    ]


def _weights_comment(weights: Array) -> str:
    data = base64.b64encode(weights.astype("<f4").tobytes()).decode()
    height, width, _ = weights.shape
    lines = [data[i : i + 116] for i in range(0, len(data), 116)]
    return f"\n// weights: {width} x {height} RGBA32F, little-endian float32, rows in order, base64:\n" + "".join(
        f"// {line}\n" for line in lines
    )
