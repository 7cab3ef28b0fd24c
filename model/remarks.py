"""What a person should know of a model's training beside its figures: lines for `train`, `info` and their JSON."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, TypeGuard

from .surface_figures import surface_record

FEWEST_STEPS = 800
"""Steps below which a network is rough, whatever the seconds hold."""
FEW = 0.5
"""Least share of the planned steps that needs no remark."""
MOST = 1e9
"""Largest number of a record: of steps, or of seconds."""


def remarks(provenance: Mapping[str, Any]) -> list[str]:
    """Return the lines of a provenance, which may have any content; none where the training was interrupted."""
    if provenance.get("interrupted"):
        return []
    record = surface_record(provenance)
    return [line for line in (_few_steps(provenance), "" if record is None else record.warning()) if line]


def _few_steps(provenance: Mapping[str, Any]) -> str:
    """Return a line about stages that took far fewer steps than their seconds hold; "" without such a stage."""
    settings, elapsed = provenance.get("settings"), provenance.get("seconds")
    seconds = settings.get("seconds") if isinstance(settings, dict) else None
    if not (_is_number(seconds) and _is_number(elapsed)):
        return ""
    short = [(name, *counts) for name, record in _stages(provenance) if (counts := _counts(record)) is not None]
    if not short:
        return ""
    stages = ", ".join(
        f"{name} {'took ' * (not i)}{steps:,} {'steps ' * (not i)}of some {planned:,}"
        for i, (name, steps, planned, _) in enumerate(short)
    )
    more = elapsed + sum((planned - steps) * each for _, steps, planned, each in short)
    return (
        f"{stages}: the machine was busy, or --seconds {seconds:g} is too short; train again with --seconds "
        f"{_rounded_up(max(more, seconds)):g}, or without --seconds"
    )


def _stages(provenance: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    levels = provenance.get("levels")
    yield from ((f"level {i}", level) for i, level in enumerate(levels if isinstance(levels, list) else [], start=1))
    yield "the texture", provenance.get("texture")


def _counts(record: object) -> tuple[int, int, float] | None:
    """Return the steps of a stage, those that were planned, and the seconds of a step; None where it took enough."""
    if not isinstance(record, dict):
        return None
    steps, planned, each = (record.get(key) for key in ("steps", "steps_planned", "step_seconds"))
    if not (isinstance(steps, int) and isinstance(planned, int) and _is_number(each) and max(steps, planned) < MOST):
        return None
    planned = max(planned, FEWEST_STEPS)
    return None if steps >= FEW * planned else (steps, planned, each)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and 0 < value < MOST


def _rounded_up(seconds: float) -> float:
    """Round up to two digits."""
    unit = 10.0 ** (math.floor(math.log10(seconds)) - 1)
    return math.ceil(seconds / unit) * unit
