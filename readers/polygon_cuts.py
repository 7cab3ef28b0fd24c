"""Divides large polygons by diagonals, so that cutting ears, which takes the square of their corners, stays fast."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from .values import Doubles, Integers

PIECE, LARGEST = 1000, 2000
"""Most corners of a piece, and of one for which no diagonal is found."""
ROUNDS = ((4, 8, 1000), (16, 16, 4000), (64, 64, 16_000), (128, 256, 64_000))
"""Number of stretches that diagonals start at, the share 1 / K of all corners that they leave on either side, and the
number of stretches where they may end."""
NEAREST = 4  # the corners that each is joined with


def pieces(polygon: Doubles) -> Iterator[Integers]:
    """Divide a polygon (N, 2), counterclockwise and not crossing itself. Yields the corners (M,) of each piece.

    Raises UserError for a polygon for which no diagonal is found.
    """
    pending = [np.arange(len(polygon))]
    while pending:
        corners = pending.pop()
        if len(corners) <= PIECE:
            yield corners
            continue
        ends = _diagonal(polygon[corners])
        if ends is not None:
            first, last = ends
            pending += [corners[first : last + 1], np.concatenate((corners[last:], corners[: first + 1]))]
        elif len(corners) <= LARGEST:
            yield corners
        else:
            words = f"a polygon of {len(polygon):,} corners that crosses itself, or winds too much"
            raise UserError(f"{words}; triangulate the mesh")


def _diagonal(polygon: Doubles) -> tuple[int, int] | None:
    """Return two corners of a polygon (N, 2) whose connection is inside; None if none is found."""
    count = len(polygon)
    before, after = np.roll(polygon, 1, axis=0), np.roll(polygon, -1, axis=0)
    convex = _turn(before, polygon, after) > 0

    def opens(corners: Integers | int, targets: Integers | int) -> NDArray[np.bool_]:
        """Whether the ways from corners to targets start inside."""
        at, to = polygon[corners], polygon[targets]
        right, left = _turn(at, after[corners], to) > 0, _turn(at, to, before[corners]) > 0
        return np.where(convex[corners], right & left, right | left)

    for starts, share, ends in ROUNDS:
        found: list[tuple[float, int, int]] = []
        anchors = _marks(polygon, starts)
        for places in (anchors, _marks(polygon, ends)):
            for anchor in anchors.tolist():
                gap = np.abs(places - anchor)
                others = places[np.minimum(gap, count - gap) >= max(2, count / share)]
                others = others[opens(anchor, others) & opens(others, anchor)]
                lengths = ((polygon[others] - polygon[anchor]) ** 2).sum(axis=1)
                found += [(float(lengths[k]), anchor, int(others[k])) for k in np.argsort(lengths)[:NEAREST]]
        for _, first, last in sorted(set(found)):  # long ones would leave slivers
            if not _meets(polygon, after, first, last):
                return min(first, last), max(first, last)
    return None


def _marks(polygon: Doubles, stretches: int) -> Integers:
    """Return some corners of a polygon (N, 2): of each stretch the first, and the deepest inside, which sees most."""
    count = len(polygon)
    if count <= 2 * stretches:
        return np.arange(count)
    bounds = np.linspace(0, count, stretches + 1).astype(np.int64)
    across, up = (polygon[bounds[1:] % count] - polygon[bounds[:-1]]).T
    spans = zip(bounds[:-1].tolist(), bounds[1:].tolist(), -up, across, strict=True)
    deepest = [start + int((polygon[start:end] @ (x, y)).argmax()) for start, end, x, y in spans]
    return np.unique(np.concatenate((bounds[:-1], np.array(deepest, np.int64))))


def _meets(polygon: Doubles, after: Doubles, first: int, last: int) -> bool:
    """Whether the connection of two corners touches other edges of a polygon (N, 2). after: the ends of the edges."""
    a, b = polygon[first], polygon[last]
    sides, of_first, of_last = _turn(a, b, polygon), _turn(polygon, after, a), _turn(polygon, after, b)
    meets = (sides * np.roll(sides, -1) <= 0) & (of_first * of_last <= 0)
    meets[[first, first - 1, last, last - 1]] = False  # the edges at its ends
    return bool(meets.any())


def _turn(a: Doubles, b: Doubles, c: Doubles) -> NDArray[np.float64]:
    """Return twice the areas of triangles, positive for those that turn left. a, b, c: (..., 2)."""
    ab, ac = b - a, c - a
    return np.asarray(ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0])
