"""Computes a grid of cells: which the surface cannot cross, and its distance from the others (cells.py)."""

import itertools

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Program
from .cell_codes import OVERESTIMATE, REACH, all_cells, coded, cut_in_eight, interpolated, middles, value_of
from .interpret import nested_field

FIRST = 16
"""Cells along an edge of the coarsest grid; cells that the surface may cross are cut into eight, repeatedly."""
CHUNK = 65_536
"""Number of cells whose field is evaluated together."""
MISSED = 1.3
"""The excess of interpolation over the field is measured at the cells' corners, and this times the excess is
subtracted, because the excess may be larger elsewhere."""


def found_grid(program: Program, count: int, half: float, slack: float = 0.0) -> NDArray[np.uint8]:
    """Return the grid of `Cells.grid` for a program that does not move.

    count: cells along an edge, a power of 2. half: half the edge of the cube. slack: increase of each cell's reach and
    decrease of its value, in the unit of f.
    """
    edge = min(FIRST, count)
    cells = all_cells(edge)
    while edge < count:
        reach = OVERESTIMATE * np.sqrt(3) * half / edge + slack
        near = np.abs(_values(program, middles(cells, edge, half), 1)) < program.bands[0].delta + reach
        cells, edge = cut_in_eight(cells[near]), 2 * edge
    scale = 0.5 * count / half
    reach = REACH / scale
    values = _nested(program, middles(cells, edge, half), reach + slack)
    kept = values < reach + slack
    values = np.where(values > 0, program.bands[-1].step_bound, 1) * values - slack
    codes = _sizes_around(cells[kept], count)
    z, y, x = cells[kept].T[::-1]
    codes[z, y, x] = coded(scale * values[kept])
    corners, excess = _excess(program, cells[np.abs(values) < reach], codes, scale, slack)
    lowered = largest_around(corners - 1, excess, count)
    codes[z, y, x] = coded(value_of(codes[z, y, x]) - MISSED * lowered[z, y, x])
    return codes


def largest_around(first: NDArray[np.int64], excess: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """Return for each cell [z, y, x] the largest excess at the places between its middle and other middles.

    first: (M, 3), the lowest of the eight cells whose middles surround a place, as x, y, z. excess: (M,).
    """
    found = np.zeros((count,) * 3, np.float32)
    for step in itertools.product((0, 1), repeat=3):
        x, y, z = np.clip(first + step, 0, count - 1).T
        np.maximum.at(found, (z, y, x), excess)
    return found


def _excess(
    program: Program, cells: NDArray[np.int64], codes: NDArray[np.uint8], scale: float, slack: float
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return the corners (K, 3) of cells (M, 3) outside the shape, and the excess of interpolation there.

    The excess over the field (K,), at least 0, is in edges of a cell.
    """
    count = len(codes)
    corners = (cells[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T).reshape(-1, 3)
    corners = corners[((corners > 0) & (corners < count)).all(axis=1)]
    keys = np.unique(corners @ np.array([1, count, count**2]))
    corners = np.stack([keys % count, keys // count % count, keys // count**2], axis=1)
    between = interpolated(codes, corners.astype(np.float64))
    corners, between = corners[between > 0], between[between > 0]
    points = ((2 * corners / count - 1) * (0.5 * count / scale)).astype(np.float32)
    values = _nested(program, points, REACH / scale + slack) - slack
    return corners, np.maximum(between - np.minimum(scale * values, REACH), 0).astype(np.float32)


def _nested(program: Program, points: NDArray[np.float32], margin: float) -> NDArray[np.float32]:
    """Evaluate all levels at points (N, 3), each in the band of the previous level, widened by `margin`."""
    return _values(program, points, len(program.bands), margin)


def _values(program: Program, points: NDArray[np.float32], level: int, margin: float = 0.0) -> NDArray[np.float32]:
    """Evaluate the nested field up to `level` at points (N, 3), with bands widened by `margin`."""
    parts = np.array_split(points, 1 + len(points) // CHUNK)
    margins = [margin] * (level - 1)
    return np.concatenate([nested_field(program, part, level, margins=margins)[0] for part in parts])


def _sizes_around(occupied: NDArray[np.int64], count: int) -> NDArray[np.uint8]:
    """Return the empty-cube sizes of a grid with occupied cells (M, 3), as x, y, z."""
    full: NDArray[np.bool_] = np.zeros((count, count, count), np.bool_)
    full[occupied[:, 2], occupied[:, 1], occupied[:, 0]] = True
    sizes: NDArray[np.uint8] = np.zeros(full.shape, np.uint8)
    for power in range(1, count.bit_length()):
        side = full.shape[0] // 2
        full = np.asarray(full.reshape(side, 2, side, 2, side, 2).any(axis=(1, 3, 5)))
        empty: NDArray[np.bool_] = ~full
        for axis in range(3):
            empty = empty.repeat(1 << power, axis=axis)
        sizes[empty] = power
    return sizes
