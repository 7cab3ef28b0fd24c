"""Facts about a model: its levels, their costs, and the size of each target."""

from typing import Any

from ..ir.lower import lower
from ..ir.program import Cost
from ..model.errors import UserError
from ..model.model import Model, level_networks, size_text
from ..model.model import sizes as sizes_of
from ..model.model_file import to_bytes
from ..model.packed_weights import pack
from ..model.remarks import remarks
from .registry import TARGETS


def model_facts(model: Model, *, sizes: bool = False) -> dict[str, Any]:
    """Return the facts that `info --json` prints. sizes: also "bytes", those of each target, which is baked for it."""
    program = lower(model)
    levels = []
    total = Cost(0, 0)
    for i, (level, cost) in enumerate(zip(model.levels, program.value_costs(), strict=True)):
        total += cost
        networks = level_networks(model, i)
        levels.append(
            {
                "network": sizes_of(networks),
                "parameters": sum(layer.weight.size + layer.bias.size for network in networks for layer in network),
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
        "file": _file(model),
        "texture": None if model.texture is None else size_text(model.texture),
        "shapes": [shape.name for shape in model.shapes],
        "inputs": model.inputs,
        "centre": model.center,
        "scale": model.scale,
        "up": model.up,
        "front": model.front,
        "credit": model.credit,
        **({"bytes": _target_sizes(model)} if sizes else {}),
        "warnings": remarks(model.provenance),
        "provenance": model.provenance,
    }


def _file(model: Model) -> dict[str, Any]:
    """Return the bytes of the model's file, the bits of its weights over their number, and whether they are packed."""
    packed = pack(model.networks())
    bits = 32.0 if packed is None else 8 * len(packed) / model.parameters()
    return {"bytes": len(to_bytes(model)), "bits": bits, "packed": packed is not None}


def _target_sizes(model: Model) -> dict[str, int | None]:
    """Return the bytes of each target's text; None where it refuses the model."""
    found: dict[str, int | None] = {}
    for name, target in TARGETS.items():
        try:
            found[name] = target.size(model)
        except UserError:
            found[name] = None
    return found
