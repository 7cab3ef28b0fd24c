"""The parts of a scene's page: the text and the weights of its field, printed by Python, instead of a model file."""

from typing import Any

import numpy as np

from ..codegen.printers.field import FieldText
from ..ir.program import Program
from ..model.model import Model
from ..model.scene import shapes_of


def scene_facts(model: Model, program: Program, field: FieldText) -> dict[str, Any]:
    """Return the facts for baked_scene.js: the keys of parseModel, and the field without its texels."""
    assert model.scene is not None
    levels = [
        {
            "delta": band.delta,
            "iterations": band.iterations,
            "bounds": {"step_bound": band.step_bound, "band_step_bound": band.band_step_bound},
        }
        for band in program.bands
    ]
    loops = {"value": field.value_loops, "gradient": field.gradient_loops, "texture": field.texture_loops}
    return {
        "inputs": model.inputs,
        "parameters": model.parameters(),
        "shapes": len(list(shapes_of(model.scene))),
        "texture": program.colored,
        "levels": levels,
        "text": field.text,
        "loops": loops,
        "texels": len(field.layout.texels),
        "size": _kind(field).itemsize,
    }


def texel_bytes(field: FieldText) -> bytes:
    """Return the weights, texel after texel, in 16-bit floats if they are exact, else in 32-bit floats."""
    return field.layout.texels.astype(_kind(field)).tobytes()


def _kind(field: FieldText) -> np.dtype[Any]:
    texels = field.layout.texels
    with np.errstate(over="ignore"):
        exact = np.array_equal(texels.astype("<f2").astype(np.float32), texels)
    return np.dtype("<f2" if exact else "<f4")
