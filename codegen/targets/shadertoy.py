"""Target shadertoy: the text of Shadertoy's Image tab, with packed or literal weights."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from ...field.bits import cost, fewest_bits
from ...field.digits import fewest_digits
from ...field.rounding import decimals_line
from ...ir.lower import lower
from ...ir.program import Program
from ...model.errors import UserError
from ...model.model import Model
from ...model.quantize import is_quantized, quantized_model
from ..printers.cstyle import Storage
from ..printers.literal import LiteralStorage
from ..printers.packed import PackedStorage
from .baked import Baked
from .shadertoy_text import shader_text

WIDEST = 64
"""Largest width of a layer: with wider ones, browsers take minutes to compile the text, or crash."""


@dataclass(frozen=True, eq=False)
class Emitted:
    """The weights of a text."""

    program: Program
    """The model with the weights of the text."""
    storage: type[Storage]
    """How the text stores them."""
    further: dict[str, Any]
    """Facts for the header: the errors of rounding, if there are any."""
    rounding: str | None
    """For people: how far the weights are rounded."""


def baked(model: Model, storage: str = "auto", digits: int | None = None, shade: str | None = None) -> Baked:
    """Return the text of a model, and how far its weights are rounded.

    storage, digits: see `emitted`. shade: "softbox" (with a setting for Phong); "phong" (without the softbox); None for
    the softbox where it adds at most SOFTBOX_SHARE. Raises UserError for a model that is too wide, or another storage.
    """
    chosen = emitted(model, storage, digits)
    return Baked(shader_text(chosen.program, model, chosen.storage, chosen.further, shade), chosen.rounding)


@lru_cache(maxsize=1)
def emitted(model: Model, storage: str = "auto", digits: int | None = None) -> Emitted:
    """Choose the weights of a text.

    storage: "packed": quantized weights (model/quantize.py), exact where training quantized them. "literal": decimals.
    "auto": packed with the fewest bits that keep surface and colors (field/bits.py), or literal where no number of bits
    does, where the field moves, or where `digits` is set for a model without quantized weights.
    digits: decimals of literal weights; None for the fewest that keep the surface (field/digits.py). Raises UserError
    for a model that is too wide, or another storage.
    """
    parts = model.shapes or (model,)
    networks = model.networks().values()
    widest = max(layer.weight.shape[0] for network in networks for layer in network)
    if widest > WIDEST:
        raise UserError(
            f"shadertoy: a layer is {widest} wide, and browsers compile {WIDEST} at most; "
            "train a smaller model (--preset small), or bake --target html"
        )
    if storage not in ("auto", "packed", "literal"):
        raise UserError(f"--storage {storage}: shadertoy has no texture for weights; there is packed, literal")
    without_motion = all(part.inputs == "xyz" for part in parts)
    if storage == "packed" and not without_motion:
        raise UserError("--storage packed: this model moves; use literal")
    if storage == "auto" and without_motion and (digits is None or all(map(is_quantized, networks))):
        fewest = [fewest_bits(part) for part in parts]
        if None not in fewest:
            return _packed(_with_parts(model, [part for part in fewest if part]), model)
        if all(map(is_quantized, networks)):
            storage = "packed"
    if storage == "packed":
        return _packed(_with_parts(model, list(map(quantized_model, parts))), model)
    program = lower(model, max(map(fewest_digits, parts)) if digits is None else digits, padded=False)
    return Emitted(program, LiteralStorage, {}, None if digits is None else decimals_line(model, digits))


def exact(model: Model, digits: int | None = None, shade: str | None = None) -> str:
    """Return a text without a search: packed where training quantized the weights, otherwise literal."""
    return baked(model, storage_without_search(model), digits, shade).text


def storage_without_search(model: Model) -> str:
    """Return "packed" where training quantized the weights, otherwise "literal"."""
    without_motion = all(part.inputs == "xyz" for part in model.shapes or (model,))
    return "packed" if without_motion and all(map(is_quantized, model.networks().values())) else "literal"


def _with_parts(model: Model, parts: Sequence[Model]) -> Model:
    """Return a model with other weights. parts: a scene's models with their new weights, or the new model."""
    return parts[0] if model.scene is None else replace(model, shapes=tuple(parts))


def _packed(packed: Model, model: Model) -> Emitted:
    """Return packed weights; the header states the error of rounding.

    packed: the model with rounded weights. model: the original.
    """
    paid = cost(model, packed)
    error = {"f": paid.distance, "degrees": paid.angle} | ({"colour": paid.color} if model.colored else {})
    program = lower(packed, padded=False)
    if not paid.largest:
        return Emitted(program, PackedStorage, {}, None)
    error = {key: float(f"{value:.2g}") for key, value in error.items()}
    colors = f", colors by {error['colour']:g}/255" if "colour" in error else ""
    line = (
        f"weights of few bits: near the surface, distances are off by {error['f']:.1e} (the shape has radius 1), "
        f"normals by {error['degrees']:g} degrees{colors} (root mean square)"
    )
    return Emitted(program, PackedStorage, {"error": error}, line)
