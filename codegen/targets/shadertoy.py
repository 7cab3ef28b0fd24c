"""Target shadertoy: the text of Shadertoy's Image tab."""

import math
import re
from dataclasses import replace

from ... import glsl
from ...model.errors import UserError
from ...model.model import Model
from ...model.quantise import is_quantised, quantised_model
from ..ir.lower import lower
from ..ir.program import Program
from ..printers.cstyle import Language, Storage
from ..printers.literal import LiteralStorage
from ..printers.packed import PackedStorage
from ..reference.digits import fewest_digits
from ..reference.march import OFFSET
from .header import header_facts, header_line

WIDEST = 64
"""Width of the widest layer that is baked: with wider ones, browsers take minutes to compile the text, or crash."""
PLAIN = "vec3(.6, .5, .39)"
"""Colour of a model without a texture: that of printers/field.py, in linear light."""
LANGUAGE = Language(function="{type} {name}(vec4 p)")
"""GLSL ES 3.00, in which every function of the field takes the program's input as it is."""


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """Return the text of a model.

    storage: "packed", "literal", or "auto": packed where the weights are quantised (model/quantise.py).
    digits: decimals of literal weights, None for the fewest that keep the surface (codegen/reference/digits.py).
    Raises UserError where the model is too wide, or the storage is none of these.
    """
    networks = [level.network for level in model.levels] + ([] if model.texture is None else [model.texture])
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
    if storage == "packed" or (storage == "auto" and model.inputs == "xyz" and all(map(is_quantised, networks))):
        return _text(lower(quantised_model(model)), model, PackedStorage)
    return _text(lower(model, fewest_digits(model) if digits is None else digits), model, LiteralStorage)


def _text(program: Program, model: Model, storage: type[Storage]) -> str:
    """Return the text: weights, networks, field() and the hand-written rest in glsl/shadertoy.glsl."""
    time = "iTime" if program.moving else "1"
    values = program.values if len(program.values) > 1 else (replace(program.values[0], name="field"),)
    functions = values + (() if program.texture is None else (program.texture,))
    printer = storage(program, LANGUAGE, functions)
    lines = printer.declarations()
    for function in functions:
        lines += printer.definition(function)
    albedo = PLAIN
    if program.texture is not None:
        albedo = f"pow(clamp({program.texture.name}(vec4(3.52 * m[2] + t * v, {time})), 0., 1.), vec3(2.2))"
    bound = _bound(program)
    rest = re.sub(r"(?m)^//.*\n", "", glsl.load("shadertoy.glsl")).replace(", 1));", f", {time}));")
    rest = rest.replace("STEP * f", "f" if bound == 1 else f"{LANGUAGE.number(bound)} * f")
    text = "\n".join([*lines, *_field(program), rest.replace("ALBEDO", albedo)])
    if storage is PackedStorage:
        text = _squeezed(text)
    return header_line(header_facts(model, program, "shadertoy")) + "\n" + text


def _field(program: Program) -> list[str]:
    """Return field(), which evaluates a level inside the band of the one before it (Eq. 3).

    Outside the band it gives the distance to the band's offset surface. A single level is field() itself.
    """
    if len(program.values) == 1:
        return []
    lines = ["float field(vec4 p) {", f"    float f = {program.values[0].name}(p);"]
    for function, band in zip(program.values[1:], program.bands, strict=False):
        lines.append(f"    if (abs(f) > {_short(band.delta)}) return f - {_short(band.delta / OFFSET)};")
        lines.append(f"    f += {function.name}(p);")
    return [*lines, "    return f;", "}"]


def _bound(program: Program) -> float:
    """Return the factor on every step, of two digits: the smallest of all levels'."""
    *coarser, last = program.bands
    return math.floor(100 * min(last.step_bound, *(band.band_step_bound for band in coarser), 1.0) + 1e-6) / 100


def _short(value: float) -> str:
    """Return a number as a literal of three digits."""
    return LANGUAGE.number(float(f"{value:.3g}"))


def _squeezed(text: str) -> str:
    """Return GLSL without indentation, comments and spaces around operators; lines stay lines."""
    text = re.sub(r"(?m)^\s+|\s*//.*$", "", text)
    return re.sub(r" *([-+*/=<>,;(){}?:&|]) *", r"\1", text)
