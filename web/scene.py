"""What a page holds of a scene: its field's text and weights, as Python prints them, in place of a model's file."""

from typing import Any

import numpy as np

from ..codegen.printers.field import FieldText
from ..ir.program import Program
from ..model.model import Model
from ..model.scene import shapes_of


def scene_facts(model: Model, program: Program, field: FieldText) -> dict[str, Any]:
    """Return what web/baked.js reads, beside the texels: parseModel's keys, and what is drawn with them."""
    assert model.scene is not None
    bounds = [{"step_bound": band.step_bound, "band_step_bound": band.band_step_bound} for band in program.bands]
    levels = [
        {"delta": band.delta, "iterations": band.iterations, "bounds": bound}
        for band, bound in zip(program.bands, bounds, strict=True)
    ]
    loops = {"value": field.value_loops, "gradient": field.gradient_loops, "texture": field.texture_loops}
    return {
        "inputs": model.inputs,
        "parameters": model.parameters(),
        "shapes": len(list(shapes_of(model.scene))),
        "texture": program.coloured,
        "levels": levels,
        "text": field.text,
        "loops": loops,
        "texels": len(field.layout.texels),
        "size": _kind(field).itemsize,
    }


def texel_bytes(field: FieldText) -> bytes:
    """Return the weights, texel after texel, in 16-bit floats where they hold every one, else in 32-bit ones."""
    return field.layout.texels.astype(_kind(field)).tobytes()


def _kind(field: FieldText) -> np.dtype[Any]:
    texels = field.layout.texels
    with np.errstate(over="ignore"):
        exact = np.array_equal(texels.astype("<f2").astype(np.float32), texels)
    return np.dtype("<f2" if exact else "<f4")
