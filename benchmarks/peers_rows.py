"""The rows of docs/results/peers.md: who is better at equal errors, in sentences and in tables."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

ERRORS = ("distance", "angle", "color")
"""Attributes of a row."""
FROM = 8000
"""Bytes from which our packed files are not to be larger than Draco's."""
APART = 1.2
"""Least ratio of the bytes of two rows of a method in a table."""
OURS, PACKED, DRACO, DRACO_COLORS = "ours", "ours, packed file", "Draco", "Draco and WebP"


@dataclass(frozen=True)
class Row:
    """A file, and the errors of its surface."""

    method: str
    setting: str
    size: int
    """Bytes."""
    distance: float
    """As of `peers_surface.Errors`."""
    angle: float
    color: float | None
    seconds: float | None = None
    """Of the processor, where they are measured."""


def front_of(rows: Sequence[Row], error: str) -> list[Row]:
    """Return the rows that have a smaller error than every row with fewer bytes. error: of ERRORS."""
    front: list[Row] = []
    for row in sorted(rows, key=lambda row: row.size):
        found = getattr(row, error)
        if found is not None and (not front or found < getattr(front[-1], error)):
            front.append(row)
    return front


def fitting(rows: Sequence[Row], wanted: float, error: str) -> float:
    """Return the bytes of the front of some rows at an error: interpolated, both logarithmic.

    wanted: the error. Beyond the smallest error of all rows: infinity.
    """
    front = front_of(rows, error)
    if not front or getattr(front[-1], error) > wanted:
        return np.inf
    sizes, errors = np.log([(row.size, getattr(row, error)) for row in front]).T
    return float(np.exp(np.interp(-np.log(wanted), -errors, sizes)))


def bytes_for(rows: Sequence[Row], like: Row) -> float:
    """Return the bytes with which a method reaches all errors of a row, each on the front of its own."""
    return max(fitting(rows, wanted, error) for error in ERRORS if (wanted := getattr(like, error)) is not None)


def verdict(name: str, rows: Sequence[Row]) -> list[str]:
    """Say for every packed file of ours, from FROM bytes on, whether Draco's is smaller at equal errors."""
    lines = []
    for row in rows:
        if row.method != PACKED or row.size < FROM:
            continue
        peer = DRACO if row.color is None else DRACO_COLORS
        theirs = [other for other in rows if other.method == peer]
        needed = bytes_for(theirs, row)
        single = ", ".join(
            f"{_bytes(fitting(theirs, wanted, error))} for the {_NAMES[error]}"
            for error in ERRORS
            if (wanted := getattr(row, error)) is not None
        )
        word = "holds" if row.size <= needed else "**does not hold**"
        lines.append(f"- {name}, {row.setting}: {word}. Ours: {row.size:,} bytes. {peer}: {single} of ours.")
    return lines


_NAMES = {"distance": "distance", "angle": "normals", "color": "colors"}


def _bytes(size: float) -> str:
    return "none" if np.isinf(size) else f"{size:,.0f}"


def losses(name: str, rows: Sequence[Row]) -> list[str]:
    """Say which methods need fewer bytes than our packed files for their errors, and which reach smaller errors."""
    lines, methods = [], list(dict.fromkeys(row.method for row in rows if not row.method.startswith(OURS)))
    mine = [row for row in rows if row.method == PACKED]
    for row in mine:
        needed = {method: bytes_for([other for other in rows if other.method == method], row) for method in methods}
        better = [f"{method} {needed[method]:,.0f}" for method in methods if needed[method] < row.size]
        if better:
            lines.append(f"- {name}, {row.setting}: ours takes {row.size:,} bytes; for its errors {', '.join(better)}.")
    for error in ERRORS:
        known = [row for row in rows if getattr(row, error) is not None]
        best = min(
            (row for row in known if row.method.startswith(OURS)), key=lambda row: getattr(row, error), default=None
        )
        ahead = [
            f"{first.method} ({_shown(first, error)}, {first.size:,} bytes)"
            for method in methods
            if (
                of_method := [
                    row for row in known if row.method == method and best and getattr(row, error) < getattr(best, error)
                ]
            )
            for first in (min(of_method, key=lambda row: row.size),)
        ]
        if best and ahead:
            lines.append(
                f"- {name}: no file of ours has {_NAMES[error]} below {_shown(best, error)} ({best.size:,} bytes); "
                f"these have: {', '.join(ahead)}."
            )
    return lines


def _shown(row: Row, error: str) -> str:
    value = getattr(row, error)
    return {"distance": f"{value:.2e}", "angle": f"{value:.2f} degrees", "color": f"{value:.1f}"}[error]


def table(rows: Sequence[Row]) -> list[str]:
    """Return the table of a shape: for each method, rows from few bytes to many, without those that others beat.

    A shape without colors has no column of them.
    """
    colored = any(row.color is not None for row in rows)
    lines = [
        f"| method | setting | bytes | distance | normals |{' colors |' * colored}",
        f"| --- | --- | ---: | ---: | ---: |{' ---: |' * colored}",
    ]
    for method in dict.fromkeys(row.method for row in rows):
        same = [row for row in rows if row.method == method]
        shown: list[Row] = []
        for row in sorted(same, key=lambda row: -row.size):
            if not any(beats(other, row) for other in same) and (not shown or APART * row.size < shown[-1].size):
                shown.append(row)
        for place, row in enumerate(reversed(shown)):
            color = "" if row.color is None else f"{row.color:.1f}"
            seconds = "" if row.seconds is None else f", {row.seconds:.0f} s"
            cells = ["" if place else method, f"{row.setting}{seconds}", f"{row.size:,}"]
            cells += [f"{row.distance:.2e}", f"{row.angle:.2f}", *([color] if colored else [])]
            lines.append(f"| {' | '.join(cells)} |")
    return lines


def beats(one: Row, other: Row) -> bool:
    """Whether a row of the same method is nowhere worse than another, and has fewer bytes."""
    errors = [(getattr(one, error), getattr(other, error)) for error in ERRORS]
    return one.size < other.size and all(a <= b for a, b in errors if a is not None and b is not None)
