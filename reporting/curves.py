"""The log of a training (`train --log`) as curves, in SVG."""

import html
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..model.checks import check_json
from ..model.errors import UserError
from ..model.files import regular, show

WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM = 640, 260, 56, 24, 28
"""Size of a diagram, and its margins for numbers, in units of the SVG."""
NAMES = {
    "mean_f": "mean |f|, held out",
    "loss": "loss",
    "value": "value term",
    "normal": "normal term",
    "distance": "distance term",
    "eikonal": "Eikonal term",
    "colour": "color term",
    "along": "term along normals",
}
"""Key in the log -> its name in the legend, in order."""
MOST = 400
"""Largest number of points of a curve."""
LEAST = 1e-12
"""Smallest drawn value, because the axis is logarithmic."""

Line = dict[str, Any]


def read_log(path: Path) -> list[list[Line]]:
    """Read the lines of each network from a log, in training order, its runs joined. Raises UserError."""
    stages: dict[tuple[object, str], list[Line]] = {}
    try:
        texts = regular(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{show(path)}: {getattr(error, 'strerror', None) or 'not a text file'}") from None
    for number, text in enumerate(texts, start=1):
        try:
            line = json.loads(text)
            check_json("line", line)
            level, network = line["level"], str(line["network"])
            if not math.isfinite(float(line["step"])):
                raise ValueError
        except (ValueError, KeyError, TypeError, RecursionError, UserError):
            if number == len(texts) and number > 1:
                break  # a killed training may leave half a line
            raise UserError(f"{show(path)}:{number}: not a line of `train --log`") from None
        stages.setdefault((str(level), network), []).append(line)
    if not stages:
        raise UserError(f"{show(path)}: the log is empty")
    return list(stages.values())


def title_of(stage: Sequence[Line]) -> str:
    """Return the title of a network: `level 2 (64x2)`, or `texture (64x2)`."""
    level, network = stage[0]["level"], stage[0]["network"]
    return f"texture ({network})" if level is None else f"level {level} ({network})"


def diagram(stage: Sequence[Line]) -> str:
    """Draw the curves of a network over its steps, on a logarithmic axis, as SVG with a legend."""
    curves = {key: points for key in NAMES if (points := list(_points(stage, key)))}
    if not curves:
        return "<p>The log has no values for this network.</p>"
    values = [y for points in curves.values() for _, y in points]
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    high = max(high, low + 1)
    last = max(x for points in curves.values() for x, _ in points) or 1.0

    def at(x: float, y: float) -> str:
        across = LEFT + (WIDTH - LEFT - RIGHT) * x / last
        up = (math.log10(y) - low) / (high - low)
        return f"{across:.1f},{8 + (HEIGHT - BOTTOM - 8) * (1 - up):.1f}"

    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{html.escape(title_of(stage))}">']
    for power in range(low, high + 1, max(1, (high - low) // 6)):
        y = at(0, 10.0**power).partition(",")[2]
        parts.append(
            f'<path class="grid" d="M{LEFT},{y}H{WIDTH - RIGHT}"/><text x="{LEFT - 6}" y="{y}">1e{power}</text>'
        )
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x = at(share * last, 10.0**low).partition(",")[0]
        parts.append(f'<text class="below" x="{x}" y="{HEIGHT - 8}">{share * last:,.0f}</text>')
    for key, points in curves.items():
        parts.append(f'<polyline class="{key}" points="{" ".join(at(x, y) for x, y in points)}"/>')
    legend = "".join(f'<li><i class="{key}"></i>{html.escape(NAMES[key])}</li>' for key in curves)
    return "".join(parts) + f'</svg><ul class="legend">{legend}</ul>'


def _points(stage: Sequence[Line], key: str) -> Iterator[tuple[float, float]]:
    """Yield (step, value) of a curve, at most about MOST. Steps of a further run continue those of the previous run."""
    last, offset, every = 0.0, 0.0, max(1, len(stage) // MOST)
    for i, line in enumerate(stage):
        step, value = float(line["step"]), line.get(key)
        if step <= last:
            offset += last
        last = step
        if isinstance(value, int | float) and math.isfinite(value) and (i % every == 0 or i == len(stage) - 1):
            yield offset + step, max(float(value), LEAST)
