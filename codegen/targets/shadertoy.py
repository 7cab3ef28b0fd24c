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


def standalone(model: Model, storage: str = "auto", digits: int | None = None, shade: str | None = None) -> str:
    """Return the text of a model.

    storage, digits: see `emitted`. shade: "studio" (with a setting for Phong); "phong" (without the studio); None for
    the studio where it adds at most STUDIO_SHARE. Raises UserError for a model that is too wide, or another storage.
    """
    chosen = emitted(model, storage, digits)
    return shader_text(chosen.program, model, chosen.storage, chosen.further, shade)


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
    return Emitted(program, LiteralStorage, {})


def rounding(model: Model, storage: str = "auto", digits: int | None = None) -> str | None:
    """Say how far the weights of the text are rounded. See `bake.registry.Target.rounding`."""
    chosen = emitted(model, storage, digits)
    if chosen.storage is LiteralStorage:
        return None if digits is None else decimals_line(model, digits)
    if (error := chosen.further.get("error")) is None:
        return None
    colors = f", colors by {error['colour']:g}/255" if "colour" in error else ""
    return (
        f"weights of few bits: near the surface, distances are off by {error['f']:.1e} (the shape has radius 1), "
        f"normals by {error['degrees']:g} degrees{colors} (root mean square)"
    )


def exact(model: Model, digits: int | None = None, shade: str | None = None) -> str:
    """Return a text without a search: packed where training quantized the weights, otherwise literal."""
    return standalone(model, storage_without_search(model), digits, shade)


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
    further = {"error": {key: float(f"{value:.2g}") for key, value in error.items()}} if paid.largest else {}
    return Emitted(lower(packed, padded=False), PackedStorage, further)
