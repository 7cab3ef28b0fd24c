"""What is known of a model: its levels, what they cost, and how large each target's text is."""

from typing import Any

from ..model.errors import UserError
from ..model.model import Model, shape_of
from .ir.lower import lower
from .ir.program import Cost
from .targets.registry import TARGETS, Target


def model_facts(model: Model) -> dict[str, Any]:
    """Collect what `info --json` prints."""
    program = lower(model)
    levels = []
    total = Cost(0, 0)
    for level, function in zip(model.levels, program.values, strict=True):
        total += program.cost(function)
        levels.append(
            {
                "network": shape_of(level.network),
                "parameters": sum(layer.weight.size + layer.bias.size for layer in level.network),
                "multiply_adds": total.multiply_adds,
                "sines": total.sines,
                "delta": level.delta,
                "iterations": level.iterations,
                "lipschitz": level.lipschitz,
                "step_bound": level.step_bound,
                "band_step_bound": level.band_step_bound,
            }
        )
    return {
        "name": model.name,
        "sha256": program.sha256,
        "parameters": model.parameters(),
        "levels": levels,
        "texture": None if model.texture is None else shape_of(model.texture),
        "inputs": model.inputs,
        "centre": model.centre,
        "scale": model.scale,
        "up": model.up,
        "front": model.front,
        "credit": model.credit,
        "bytes": {name: _size(model, target) for name, target in TARGETS.items()},
        "provenance": model.provenance,
    }


def _size(model: Model, target: Target) -> int | None:
    """Count the bytes of what a target writes; None where it refuses the model."""
    try:
        return target.size(model)
    except UserError:
        return None
