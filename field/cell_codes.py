"""The bytes of a grid of cells (cells.py), and the positions of its cells."""

import itertools

import numpy as np
from numpy.typing import NDArray

OVERESTIMATE = 1.3
"""Assumed largest ratio of |f| to the distance: a cell is empty if |f| in its middle exceeds this times the distance to
its corner. Trained fields reach 1.66 in slits that they close, but not near their own surface:
benchmarks/frames.py counts lost rays."""
REACH = OVERESTIMATE * np.sqrt(3) / 2
"""Largest absolute value of a cell, in edges of a cell: the value at which the surface may just touch the cell."""
EMPTY = 8
"""Bytes below this mark empty cells; the others are steps of a value, from -REACH to REACH."""


def all_cells(edge: int) -> NDArray[np.int64]:
    """Return all cells of a grid with `edge` cells along an edge, (edge^3, 3), as x, y, z."""
    return np.indices((edge,) * 3).reshape(3, -1).T


def middles(cells: NDArray[np.int64], edge: int, half: float) -> NDArray[np.float32]:
    """Return the middles (N, 3), model units, of cells (N, 3) of a grid with `edge` cells along an edge."""
    return (((2 * cells + 1) / edge - 1) * half).astype(np.float32)


def cut_in_eight(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cut cells (N, 3) into cells (8 N, 3) of a grid twice as fine."""
    return np.asarray((2 * cells[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T).reshape(-1, 3))


def value_of(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the values of bytes, in edges of a cell; REACH for empty cells."""
    levels = (255 - EMPTY) / 2
    values = np.where(codes < EMPTY, REACH, (codes - (EMPTY + levels)) / levels * REACH)
    return np.asarray(values, np.float32)


def coded(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return the bytes of values, in edges of a cell, rounded down. No byte marks an empty cell."""
    levels = (255 - EMPTY) / 2
    return np.asarray(np.clip(np.floor(EMPTY + levels + values / REACH * levels + 1e-4), EMPTY, 255), np.uint8)


def mixed(first: NDArray[np.uint8], second: NDArray[np.uint8], share: float) -> NDArray[np.uint8]:
    """Return the grid at a share of the time between two grids, by linear interpolation of the values.

    A cell that is empty in both stays empty. A cell with the smallest value in either has the smallest value: the
    surface passes it at an unknown time.
    """
    values = coded((1 - share) * value_of(first) + share * value_of(second))
    least = np.minimum(first, second)
    occupied = np.maximum(first, second) >= EMPTY
    passed = (first == EMPTY) | (second == EMPTY)
    return np.asarray(np.where(passed, EMPTY, np.where(occupied, values, least)), np.uint8)


def interpolated(codes: NDArray[np.uint8], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate values (M,) between the middles of cells. places: (M, 3), x, y, z in cells from a grid's corner."""
    first = np.floor(places - 0.5).astype(np.int64)
    share = places - 0.5 - first
    total = np.zeros(len(places))
    for step in itertools.product((0, 1), repeat=3):
        x, y, z = np.clip(first + step, 0, len(codes) - 1).T
        total += np.prod(np.where(step, share, 1 - share), axis=1) * value_of(codes[z, y, x])
    return total
