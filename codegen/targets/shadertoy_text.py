"""Prints Shadertoy's Image tab: head, settings, weights, networks, field(), and glsl/functions/shadertoy.glsl."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import glsl
from ...field.half_widths import SHARES, Grid, narrow_widths
from ...field.hull import hull
from ...field.lowest import lowest_point
from ...ir.program import Function, Program
from ...model.model import DELTA_FACTOR, Model
from ..printers.cstyle import Language, Storage
from ..printers.field import PLAIN, plain_color
from ..printers.scalars import Number, Scalar, VectorNotation, Writer
from ..printers.scene_scalars import SceneAtPoint
from .header import header_facts, header_line
from .narrow_bands import rows
from .orbit import AZIMUTH, ELEVATION
from .uniforms import default

LANGUAGE = Language(function="{type} {name}(vec4 p)")
"""GLSL ES 3.00 in which every function of the field takes the networks' input."""
STEPS = 200
"""Evaluations of the field on a ray, including those for its normal."""
SPEED = 0.3
"""Speed of the turntable, radians per second."""
HULL_SHARE = 0.03
"""Largest share of a hull in the text without it. Shorter texts have a ball around the shape."""
HULL_LENGTH = 350
"""Approximate characters of a hull."""
NARROW = ((8, 930, 0.03), (4, 270, 0.02))
"""Grids of narrow bands, the best first: cells along an edge, characters, largest share in the text."""
NARROWEST = 0.0025
"""Least half-width of a narrow band, model units: rays of a picture of 360 pixels end inside the band."""
SOFTBOX_SHARE = 0.05
"""Largest share of the softbox in the text without it. Shorter texts have only Phong shading."""
SOFTBOX = re.compile(r"(?ms)^#ifdef SOFTBOX\n(.*?)(?:^#else\n(.*?))?^#endif\n")
"""Lines of glsl/functions/shadertoy.glsl with the softbox, and the lines in their place without it."""


@dataclass(frozen=True, eq=False)
class Savings:
    """Parts of a text that save evaluations of the field."""

    planes: NDArray[np.float64] | None = None
    """(13, 2), planes of a hull around the shape; None for a ball."""
    narrow: Grid | None = None
    """Widths of level 1's band; None for one width."""


def savings(program: Program, length: int) -> Savings:
    """Return the savings for a text of `length` characters without them: none of a scene or of a moving field."""
    if program.moving or program.composition is not None:
        return Savings()
    planes = hull(program) if length * HULL_SHARE >= HULL_LENGTH else None
    count = next((count for count, characters, share in NARROW if characters <= share * length), None)
    least = narrowest(program)
    grids = () if count is None or len(program.bands) == 1 or least >= SHARES else narrow_widths(program, count)
    return Savings(planes, np.maximum(grids[0], np.uint8(least)) if grids else None)


def narrowest(program: Program) -> int:
    """Return the least width of level 1's band in its grid."""
    return math.ceil(SHARES * NARROWEST / program.bands[0].delta)


def shader_text(
    program: Program, model: Model, storage: type[Storage], further: dict[str, Any], shade: str | None
) -> str:
    """Return the text. further: additional facts for the header. shade: see shadertoy.standalone."""
    header = header_line(header_facts(model, program, "shadertoy") | further)
    weights = _weights(program, storage)

    def text(softbox: bool, saved: Savings) -> str:
        field = _field(program, softbox, saved.narrow)
        body = [*_globals(program, softbox), *weights, *field, _main(program, softbox, saved.planes)]
        settings = _settings(program, model.front, softbox)
        return "\n".join([header, *_head(model), *settings, _squeezed("\n".join(body))])

    saved = savings(program, len(text(False, Savings())))
    plain = text(False, saved)
    if shade == "phong":
        return plain
    lit = text(True, saved)
    return lit if shade == "softbox" or len(lit) <= (1 + SOFTBOX_SHARE) * len(plain) else plain


def weights_text(program: Program, storage: type[Storage]) -> str:
    """Return the part of the text that holds the weights and the networks."""
    return _squeezed("\n".join(_weights(program, storage)))


def _weights(program: Program, storage: type[Storage]) -> list[str]:
    """Return the lines of the weights and the networks."""
    functions = printed_functions(program)
    printer = storage(program, LANGUAGE, functions)
    lines = printer.declarations()
    for function in functions:
        lines += printer.definition(function)
    return lines


def _main(program: Program, softbox: bool, planes: NDArray[np.float64] | None) -> str:
    """Return mainImage(), and the planes that it reads. softbox: with the softbox's lines; planes: see `Savings`."""
    time = "TIME" if program.moving else "1"
    albedo = "COLOR"
    if program.colored:
        called = "albedo" if program.texture is None else program.texture.name
        albedo = f"clamp(COLOR({called}(vec4(3.52 * m[2] + t * v, {time}))), 0., 1.)"
    bound = step_bound(program)
    enter = _without_comments("enter_ball.glsl")
    declaration = ""
    if planes is not None:
        places = ",".join(map(_short, planes.ravel()))
        declaration = f"const float[{planes.size}] H = float[]({places});\n"
        enter += _without_comments("enter_hull.glsl")
    text = SOFTBOX.sub(lambda lines: lines[1] if softbox else lines[2] or "", _without_comments("shadertoy.glsl"))
    if "SOFTBOX\n" in text:
        raise ValueError("shadertoy.glsl has an #ifdef of another form")
    for placeholder, replacement in {
        ", 1));": f", {time}));",
        "ALBEDO": albedo,
        "f *= BOUND;\n": "" if bound == 1 else f"f *= {LANGUAGE.number(bound)};\n",
        "ENTER": enter,
    }.items():
        if (count := text.count(placeholder)) != 1:
            raise ValueError(f"shadertoy.glsl has {placeholder!r} {count} times instead of once")
        text = text.replace(placeholder, replacement)
    return declaration + text


def _globals(program: Program, softbox: bool) -> list[str]:
    """Return the declarations before field().

    k: the tap; J: the level at the ray's end point. The softbox has constants, too.
    """
    variables = "int k = -1, J;" if len(program.bands) > 1 else "int k = -1;"
    if not softbox:
        return [variables]
    floor = LANGUAGE.number(round(lowest_point(program), 4))
    return [variables, f"const float G = {floor}, Y = {_short(program.bands[0].delta)};"]


def _head(model: Model) -> list[str]:
    """Return comments about the model. Name and credit are JSON, which keeps them inside the line."""
    by = f", by {json.dumps(model.credit)}" if model.credit else ""
    return [
        f"// {json.dumps(model.name)}{by}",
        "// as a neural signed distance function, made with mplicits. Drag to orbit; edit the settings below.",
    ]


def _settings(program: Program, front: tuple[float, float] | None, softbox: bool) -> list[str]:
    """Return the settings, as #defines."""
    color = (
        "COLOR(c) c // color of the surface, sRGB; c: the model's"
        if program.colored
        else f"COLOR vec3({PLAIN}) // sRGB"
    )
    view = front or (AZIMUTH, ELEVATION)
    motion = ["TIME (.5 - .5 * cos(iTime)) // time of the motion, from 0 to 1 and back"] if program.moving else []
    level = [f"LEVEL {len(program.bands)} // finest level, from 1"] if len(program.bands) > 1 else []
    settings = [
        f"VIEW {_vector(view)} // initial azimuth and elevation, degrees",
        f"SPEED {_short(SPEED)} // speed of the turntable, radians per second",
        f"LIGHT {_vector(default('light'))} // direction to the light: right, up, back",
        color,
        f"BOTTOM {_vector(default('background_bottom'))} // background, sRGB",
        f"TOP {_vector(default('background_top'))}",
        *motion,
        *(["SOFTBOX 1 // a floor, soft shadows, sky light; 0: Phong"] if softbox else []),
        *level,
        f"STEPS {STEPS} // most evaluations of the field on a ray",
        "AA 1 // 2: 2 x 2 samples per pixel",
    ]
    return [f"#define {setting}" for setting in settings]


def _field(program: Program, softbox: bool, narrow: Grid | None) -> list[str]:
    """Return field() up to LEVEL (Eq. 3); nothing for a single level, whose network is field() itself.

    Outside a band it returns the distance to the band's offset surface. The taps of a normal take the levels and the
    band of the ray's end point: a step of the field between two taps would be a blot. The softbox's taps take level 1.
    A scene's albedo() follows. narrow: see `Savings`; V is the band's half-width.
    """
    if program.composition is not None:
        return _scene(program, softbox)
    if len(program.values) == 1:
        return []
    lines = [] if narrow is None else [_widths(narrow), "float V;"]
    lines += ["float field(vec4 p) {", f"    float f = {program.values[0].name}(p);"]
    lines += ["    if (k > 3) return f;"] if softbox else []
    for i, (function, band) in enumerate(zip(program.values[1:], program.bands, strict=False), start=2):
        width, offset, cell, here = _short(band.delta), _short(band.delta / DELTA_FACTOR), [], ""
        if i == 2 and narrow is not None:
            count = len(narrow)
            width, offset = "V", f"{_short(1 / DELTA_FACTOR)} * V"
            cell = [f"    ivec3 c = clamp(ivec3({count / 2:g}. * (p.xyz + 1.)), 0, {count - 1});"]
            here = f"V = float(Q[{count} * c.z + c.y] >> 4 * c.x & 15) * {_short(band.delta / SHARES)}, "
        lines += [
            f"#if LEVEL >= {i}",
            *cell,
            f"    if (k < 0) {here}J = abs(f) > {width} ? {i - 1} : 9;",
            f"    if (J < {i}) return f - {offset};",
            f"    f += {function.name}(p);",
            "#endif",
        ]
    return [*lines, "    return f;", "}"]


def _widths(narrow: Grid) -> str:
    """Return the band widths: four bits for each cell, a row of cells in each number."""
    numbers = [str(np.uint32(row).view(np.int32)) for row in rows(narrow)]
    return f"const int[{len(numbers)}] Q = int[]({','.join(numbers)});"


def _scene(program: Program, softbox: bool) -> list[str]:
    """Return field() and albedo() of a scene."""

    def at_point(level: str | None, deltas: Sequence[Number] | None = None) -> tuple[Writer, SceneAtPoint]:
        writer = Writer(VectorNotation(LANGUAGE), "p.w")
        return writer, SceneAtPoint(program, writer, (Scalar("p.x"), Scalar("p.y"), Scalar("p.z")), level, deltas)

    several = len(program.bands) > 1
    level = "(k < 0 ? LEVEL : k < 4 ? J : 1)" if softbox else "(k < 0 ? LEVEL : J)"
    widths = [Scalar(f"(k < 0 ? {LANGUAGE.number(band.delta)} : 9.)") for band in program.bands[:-1]]
    writer, scene = at_point(level if several else None, widths)
    value = scene.outside_bands()
    reached = [f"    if (k < 0) J = int({writer.text(scene.reached)});"] if several else []
    lines = ["float field(vec4 p) {", *writer.lines(value), *reached, f"    return {writer.text(value)};", "}"]
    writer, scene = at_point(None)
    color = scene.color(plain_color())
    result = f"    return vec3({', '.join(map(writer.text, color))});"
    return [*lines, "vec3 albedo(vec4 p) {", *writer.lines(*color), result, "}"]


def printed_functions(program: Program) -> tuple[Function, ...]:
    """Return the functions in the text: values and texture, no gradients. A single level's network is field()."""
    if program.composition is not None:
        return tuple(function for part in program.composition.programs for function in _of_model(part))
    if len(program.values) == 1:
        program = replace(program, values=(replace(program.values[0], name="field"),))
    return _of_model(program)


def _of_model(program: Program) -> tuple[Function, ...]:
    return program.values + (() if program.texture is None else (program.texture,))


def main_template() -> str:
    """Return shadertoy.glsl with the ball's lines for ENTER, squeezed: the template of web/print/shadertoy.js."""
    return _squeezed(_without_comments("shadertoy.glsl").replace("ENTER", _without_comments("enter_ball.glsl")))


def step_bound(program: Program) -> float:
    """Return the factor on every step, rounded down to two digits: the smallest of all levels."""
    *coarser, last = program.bands
    return math.floor(100 * min(last.step_bound, *(band.band_step_bound for band in coarser), 1.0) + 1e-6) / 100


def _without_comments(name: str) -> str:
    """Return a file of glsl/ without its comment lines."""
    return re.sub(r"(?m)^//.*\n", "", glsl.load(name))


def _short(value: float) -> str:
    """Return a literal with three digits."""
    return LANGUAGE.number(float(f"{value:.3g}"))


def _vector(values: Sequence[float]) -> str:
    """Return a GLSL vector with three digits per number."""
    return f"vec{len(values)}({', '.join(map(_short, values))})"


def _squeezed(text: str) -> str:
    """Return GLSL without indentation, comments and spaces around operators; lines stay lines."""
    text = re.sub(r"(?m)^\s+|\s*//.*$", "", text)
    return re.sub(r" *([-+*/=<>,;(){}?:&|]) *", r"\1", text)
