"""The log of a training (`train --log`) as curves, in SVG."""

import html
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..model.errors import UserError
from ..model.files import show

WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM = 640, 260, 56, 24, 28
"""Of a diagram, and of the margins for its numbers, in units of the SVG."""
NAMES = {
    "mean_f": "mean |f|, held out",
    "loss": "loss",
    "value": "value term",
    "normal": "normal term",
    "distance": "distance term",
    "eikonal": "Eikonal term",
    "colour": "colour term",
    "along": "term along normals",
}
"""Key in the log -> what the page calls it, in the order of the legend."""
MOST = 400
"""Points of a curve: more are not seen."""
LEAST = 1e-12
"""A value below it is drawn as it: the axis is logarithmic."""

Line = dict[str, Any]


def read_log(path: Path) -> list[list[Line]]:
    """Read a log: the lines of each network, in the order of their training.

    A network that was restarted, or gone on with, has the lines of all its runs. Raises UserError.
    """
    stages: dict[tuple[object, str], list[Line]] = {}
    try:
        texts = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{show(path)}: {getattr(error, 'strerror', None) or 'not a text'}") from None
    for number, text in enumerate(texts, start=1):
        try:
            line = json.loads(text)
            level, network, step = line["level"], str(line["network"]), float(line["step"])
        except (ValueError, KeyError, TypeError):
            if number == len(texts) and number > 1:
                break  # a training that was killed leaves half a line
            raise UserError(f"{show(path)}:{number}: no line of `train --log`") from None
        if not math.isfinite(step):
            raise UserError(f"{show(path)}:{number}: no line of `train --log`")
        stages.setdefault((str(level), network), []).append(line)
    if not stages:
        raise UserError(f"{show(path)}: the log is empty")
    return list(stages.values())


def title_of(stage: Sequence[Line]) -> str:
    """Name a network of the log: `level 2 (64x2)`, or `texture (64x2)`."""
    level, network = stage[0]["level"], stage[0]["network"]
    return f"texture ({network})" if level is None else f"level {level} ({network})"


def diagram(stage: Sequence[Line]) -> str:
    """Draw the curves of one network's training over its steps, the values on a logarithmic axis: SVG and a legend."""
    curves = {key: points for key in NAMES if (points := list(_points(stage, key)))}
    if not curves:
        return "<p>Nothing was logged of it.</p>"
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
    """Yield (step, value) of a curve, every k-th where there are many. Steps count on where a network began anew."""
    before, offset, every = 0.0, 0.0, max(1, len(stage) // MOST)
    for i, line in enumerate(stage):
        step, value = float(line["step"]), line.get(key)
        if step <= before:
            offset += before
        before = step
        if isinstance(value, int | float) and math.isfinite(value) and (i % every == 0 or i == len(stage) - 1):
            yield offset + step, max(float(value), LEAST)
