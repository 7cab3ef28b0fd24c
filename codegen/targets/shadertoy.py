"""Target shadertoy: the text of Shadertoy's Image tab."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ... import glsl
from ...model.errors import UserError
from ...model.model import Model
from ...model.quantise import is_quantised, quantised_model
from ..ir.lower import lower
from ..ir.program import Program
from ..printers.cstyle import Language, Storage
from ..printers.field import PLAIN
from ..printers.literal import LiteralStorage
from ..printers.packed import PackedStorage
from ..reference.bits import cost, fewest_bits
from ..reference.digits import fewest_digits
from ..reference.march import OFFSET
from .alone import refuse_scene
from .header import header_facts, header_line
from .orbit import AZIMUTH, ELEVATION
from .uniforms import default

WIDEST = 64
"""Width of the widest layer that is baked: with wider ones, browsers take minutes to compile the text, or crash."""
LANGUAGE = Language(function="{type} {name}(vec4 p)")
"""GLSL ES 3.00, in which every function of the field takes the program's input as it is."""
STEPS = 200
"""Evaluations of the field on a ray, those for its normal included."""
SPEED = 0.3
"""Of the turntable, radians a second."""


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """Return the text of a model.

    storage: "packed": weights as quantised (model/quantise.py), which is exact where training did it; "literal":
    decimals; "auto": packed with the fewest bits that keep the surface and the colours (codegen/reference/bits.py), and
    literal where none do, where the field moves, or where `digits` says so for a model that was not quantised.
    digits: decimals of literal weights, None for the fewest that keep the surface (codegen/reference/digits.py).
    Raises UserError where the model is too wide, or the storage is none of these.
    """
    refuse_scene(model, "Shadertoy's text")
    networks = model.networks().values()
    widest = max(layer.weight.shape[0] for network in networks for layer in network)
    if widest > WIDEST:
        raise UserError(
            f"shadertoy: a layer is {widest} wide, and browsers compile {WIDEST} at most; "
            "train a smaller model (--preset small), or bake --target html"
        )
    if storage not in ("auto", "packed", "literal"):
        raise UserError(f"--storage {storage}: shadertoy has no textures of its own; there is packed, literal")
    if storage == "packed" and model.inputs != "xyz":
        raise UserError("--storage packed: this model moves; take literal")
    if storage == "auto" and model.inputs == "xyz" and (digits is None or all(map(is_quantised, networks))):
        fewest = fewest_bits(model)
        if fewest is not None:
            return _packed(fewest, model)
        if all(map(is_quantised, networks)):
            storage = "packed"
    if storage == "packed":
        return _packed(quantised_model(model), model)
    program = lower(model, fewest_digits(model) if digits is None else digits)
    return _text(program, model, LiteralStorage, {})


def exact(model: Model, digits: int | None = None) -> str:
    """Return the text of a model in little time: packed where training quantised it, else literal."""
    packed = model.inputs == "xyz" and all(map(is_quantised, model.networks().values()))
    return standalone(model, "packed" if packed else "literal", digits)


def _packed(packed: Model, model: Model) -> str:
    """Return the text of a model with weights of few bits, and say in its header what they cost.

    packed: the model with these weights; model: with its own.
    """
    paid = cost(model, packed)
    error = {"f": paid.distance, "degrees": paid.angle} | ({} if model.texture is None else {"colour": paid.colour})
    further = {"error": {key: float(f"{value:.2g}") for key, value in error.items()}} if paid.largest else {}
    return _text(lower(packed), model, PackedStorage, further)


def _text(program: Program, model: Model, storage: type[Storage], further: dict[str, Any]) -> str:
    """Return the text: head and knobs, weights, networks, field() and the hand-written rest in glsl/shadertoy.glsl.

    further: facts for the header.
    """
    time = "TIME" if program.moving else "1"
    values = program.values if len(program.values) > 1 else (replace(program.values[0], name="field"),)
    functions = values + (() if program.texture is None else (program.texture,))
    printer = storage(program, LANGUAGE, functions)
    lines = printer.declarations()
    for function in functions:
        lines += printer.definition(function)
    albedo = "COLOUR"
    if program.texture is not None:
        albedo = f"clamp(COLOUR({program.texture.name}(vec4(3.52 * m[2] + t * v, {time}))), 0., 1.)"
    bound = _bound(program)
    rest = re.sub(r"(?m)^//.*\n", "", glsl.load("shadertoy.glsl")).replace(", 1));", f", {time}));")
    rest = rest.replace("STEP * f", "f" if bound == 1 else f"{LANGUAGE.number(bound)} * f").replace("ALBEDO", albedo)
    head = [
        header_line(header_facts(model, program, "shadertoy") | further),
        *_head(model),
        *_knobs(program, model.front),
    ]
    return "\n".join([*head, _squeezed("\n".join([*lines, *_field(program), rest]))])


def _head(model: Model) -> list[str]:
    """Return comments that tell people what this is. Name and credit are JSON, which keeps them inside the line."""
    by = f", by {json.dumps(model.credit)}" if model.credit else ""
    return [
        f"// {json.dumps(model.name)}{by}",
        "// as a neural signed distance function, made with mplicits. Drag to orbit; change what is below.",
    ]


def _knobs(program: Program, front: tuple[float, float] | None) -> list[str]:
    """Return the #defines that are there to be changed."""
    textured = program.texture is not None
    colour = "COLOUR(c) c // of the surface, sRGB; c: the model's" if textured else f"COLOUR vec3({PLAIN}) // sRGB"
    view = front or (AZIMUTH, ELEVATION)
    motion = ["TIME (.5 - .5 * cos(iTime)) // of the motion, from 0 to 1, there and back"] if program.moving else []
    level = [f"LEVEL {len(program.values)} // finest level, from 1"] if len(program.values) > 1 else []
    knobs = [
        f"VIEW {_vector(view)} // azimuth, elevation at first, degrees",
        f"SPEED {_short(SPEED)} // of the turntable, radians a second",
        f"LIGHT {_vector(default('light'))} // direction to it: right, up, back",
        colour,
        f"BOTTOM {_vector(default('background_bottom'))} // of the background, sRGB",
        f"TOP {_vector(default('background_top'))}",
        *motion,
        *level,
        f"STEPS {STEPS} // of a ray, at most",
        "AA 1 // 2: 2 x 2 samples a pixel",
    ]
    return [f"#define {knob}" for knob in knobs]


def _field(program: Program) -> list[str]:
    """Return field(), which evaluates a level inside the band of the one before it (Eq. 3), up to LEVEL.

    Outside the band it gives the distance to the band's offset surface. A single level is field() itself.
    """
    if len(program.values) == 1:
        return []
    lines = ["float field(vec4 p) {", f"    float f = {program.values[0].name}(p);"]
    for i, (function, band) in enumerate(zip(program.values[1:], program.bands, strict=False), start=2):
        lines += [
            f"#if LEVEL >= {i}",
            f"    if (abs(f) > {_short(band.delta)}) return f - {_short(band.delta / OFFSET)};",
            f"    f += {function.name}(p);",
            "#endif",
        ]
    return [*lines, "    return f;", "}"]


def _bound(program: Program) -> float:
    """Return the factor on every step, of two digits: the smallest of all levels'."""
    *coarser, last = program.bands
    return math.floor(100 * min(last.step_bound, *(band.band_step_bound for band in coarser), 1.0) + 1e-6) / 100


def _short(value: float) -> str:
    """Return a number as a literal of three digits."""
    return LANGUAGE.number(float(f"{value:.3g}"))


def _vector(values: Sequence[float]) -> str:
    """Return a vector as GLSL, with numbers of three digits."""
    return f"vec{len(values)}({', '.join(map(_short, values))})"


def _squeezed(text: str) -> str:
    """Return GLSL without indentation, comments and spaces around operators; lines stay lines."""
    text = re.sub(r"(?m)^\s+|\s*//.*$", "", text)
    return re.sub(r" *([-+*/=<>,;(){}?:&|]) *", r"\1", text)
