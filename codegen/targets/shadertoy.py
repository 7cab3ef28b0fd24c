"""Target shadertoy: the text of Shadertoy's Image tab, and how its weights are written."""

from collections.abc import Sequence
from dataclasses import replace

from ...field.bits import cost, fewest_bits
from ...field.digits import fewest_digits
from ...ir.lower import lower
from ...model.errors import UserError
from ...model.model import Model
from ...model.quantise import is_quantised, quantised_model
from ..printers.literal import LiteralStorage
from ..printers.packed import PackedStorage
from .shadertoy_text import shader_text

WIDEST = 64
"""Width of the widest layer that is baked: with wider ones, browsers take minutes to compile the text, or crash."""


def standalone(model: Model, storage: str = "auto", digits: int | None = None, shade: str | None = None) -> str:
    """Return the text of a model.

    storage: "packed": weights as quantised (model/quantise.py), which is exact where training did it; "literal":
    decimals; "auto": packed with the fewest bits that keep the surface and the colours (field/bits.py), and
    literal where none do, where the field moves, or where `digits` says so for a model that was not quantised.
    digits: decimals of literal weights, None for the fewest that keep the surface (field/digits.py).
    shade: "studio", which it opens in, with a knob for Phong; "phong", without the studio; None: the studio
    where it takes at most STUDIO_SHARE. Raises UserError where the model is too wide, or the storage is none of these.
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
        raise UserError(f"--storage {storage}: shadertoy has no textures of its own; there is packed, literal")
    still = all(part.inputs == "xyz" for part in parts)
    if storage == "packed" and not still:
        raise UserError("--storage packed: this model moves; take literal")
    if storage == "auto" and still and (digits is None or all(map(is_quantised, networks))):
        fewest = [fewest_bits(part) for part in parts]
        if None not in fewest:
            return _packed(_with_parts(model, [part for part in fewest if part]), model, shade)
        if all(map(is_quantised, networks)):
            storage = "packed"
    if storage == "packed":
        return _packed(_with_parts(model, list(map(quantised_model, parts))), model, shade)
    program = lower(model, max(map(fewest_digits, parts)) if digits is None else digits, padded=False)
    return shader_text(program, model, LiteralStorage, {}, shade)


def exact(model: Model, digits: int | None = None, shade: str | None = None) -> str:
    """Return what `standalone` does in little time: packed where training quantised it, else literal."""
    still = all(part.inputs == "xyz" for part in model.shapes or (model,))
    packed = still and all(map(is_quantised, model.networks().values()))
    return standalone(model, "packed" if packed else "literal", digits, shade)


def _with_parts(model: Model, parts: Sequence[Model]) -> Model:
    """Return a model with other weights. parts: the models of a scene with theirs, or the model itself."""
    return parts[0] if model.scene is None else replace(model, shapes=tuple(parts))


def _packed(packed: Model, model: Model, shade: str | None) -> str:
    """Return the text of a model with weights of few bits, and say in its header what they cost.

    packed: the model with these weights; model: with its own. shade: see `standalone`.
    """
    paid = cost(model, packed)
    error = {"f": paid.distance, "degrees": paid.angle} | ({"colour": paid.colour} if model.coloured else {})
    further = {"error": {key: float(f"{value:.2g}") for key, value in error.items()}} if paid.largest else {}
    return shader_text(lower(packed, padded=False), model, PackedStorage, further, shade)
