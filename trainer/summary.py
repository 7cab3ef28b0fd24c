"""The summary of a trained model that `mplicits train` prints."""

from pathlib import Path
from typing import Any

from ..model.field_figures import written
from ..model.files import show
from ..model.model import Model
from ..model.remarks import remarks
from ..model.surface_figures import surface_record


def summary(model: Model, output: Path) -> str:
    """Describe a trained model: its distance from the shape, each level, the field, and the file."""
    record = surface_record(model.provenance)
    lines = [] if record is None else [f"{label}: {text}" for label, text in record.told()]
    lines += [
        f"level {i}: {record['network']}, mean |f| {record['mean_f']:.2e}, "
        f"mean normal angle {record['angle']:.2f} degrees, delta {level.delta:.4f}, {record['steps']} steps"
        for i, (level, record) in enumerate(zip(model.levels, model.provenance["levels"], strict=True), start=1)
    ]
    field = model.provenance["field"]
    low, middle, high = field["gradient"]
    lines += [
        f"distance: off by {written(field['domain_error'], '.2e')} in the mean of the unit ball, "
        f"{written(field['band_error'], '.2e')} in the last level's band; too large at "
        f"{written(field['domain_excess'], '.2%')} of the ball",
        f"|grad f| on the surface: {middle:.2f} in the median, {low:.2f} to {high:.2f} for the middle 80 %",
    ]
    if noise := model.provenance["source"].get("noise"):
        lines.append(_noise(noise))
    lines.append(f"{show(output)}: {model.parameters()} parameters, {model.provenance['seconds']:.1f} s")
    return "\n".join(lines)


def figures(model: Model, output: Path) -> dict[str, Any]:
    """Return what `summary` says, for JSON."""
    levels = [
        {key: record.get(key) for key in ("network", "mean_f", "angle", "steps", "steps_planned")}
        | {"delta": level.delta}
        for level, record in zip(model.levels, model.provenance["levels"], strict=True)
    ]
    return {
        "output": str(output),
        "parameters": model.parameters(),
        "seconds": model.provenance["seconds"],
        "interrupted": model.provenance["interrupted"],
        "surface": model.provenance["surface"],
        "levels": levels,
        "field": model.provenance["field"],
        "noise": model.provenance["source"].get("noise"),
        "warnings": remarks(model.provenance),
    }


def _noise(record: dict[str, Any]) -> str:
    """Describe the noise that was removed from a cloud before training. record: of the provenance."""
    source = "measured" if record["measured"] else "from --noise"
    return (
        f"noise: {record['deviation']:.2%} of the radius, {source}; {record['outliers']:.1%} of the points outliers; "
        "the figures above are at held-out points that were cleaned alike, and miss errors of the cleaning"
    )
