"""What the bytes of a grid of cells stand for (cells.py), and where its cells are."""

import itertools

import numpy as np
from numpy.typing import NDArray

OVERESTIMATE = 1.3
"""How many times the distance to the shape |f| may be: a cell is empty where |f| in its middle exceeds this times the
way to its corner. Trained fields may exceed the distance by more, 1.66 times at worst in slits that they close
(docs/results/field.md), but not so near to their own surface: benchmarks/frames.py counts what is lost."""
REACH = OVERESTIMATE * np.sqrt(3) / 2
"""Largest absolute value that a cell holds, in edges of a cell: that of a cell which the surface may just touch."""
EMPTY = 8
"""Bytes below this stand for empty cells; the others are levels of a value, from -REACH to REACH."""


def all_cells(edge: int) -> NDArray[np.int64]:
    """Return all cells of a grid with so many along an edge, (edge^3, 3), as x, y, z."""
    return np.indices((edge,) * 3).reshape(3, -1).T


def middles(cells: NDArray[np.int64], edge: int, half: float) -> NDArray[np.float32]:
    """Return the middles (N, 3), model units, of cells (N, 3) of a grid with so many along an edge."""
    return (((2 * cells + 1) / edge - 1) * half).astype(np.float32)


def cut_in_eight(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the cells of a grid twice as fine, (8 N, 3), that cells (N, 3) consist of."""
    return np.asarray((2 * cells[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T).reshape(-1, 3))


def value_of(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the values, in edges of a cell, that bytes of a grid stand for; of empty cells, REACH."""
    levels = (255 - EMPTY) / 2
    values = np.where(codes < EMPTY, REACH, (codes - (EMPTY + levels)) / levels * REACH)
    return np.asarray(values, np.float32)


def coded(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return the bytes of values, in edges of a cell, of cells that are not empty; no byte stands for more."""
    levels = (255 - EMPTY) / 2
    return np.asarray(np.clip(np.floor(EMPTY + levels + values / REACH * levels + 1e-4), EMPTY, 255), np.uint8)


def between(before: NDArray[np.uint8], after: NDArray[np.uint8], share: float) -> NDArray[np.uint8]:
    """Return the grid at a share of the time from one grid to another.

    Values change evenly. A cell that is empty in both stays so, and one whose value is the least in either has the
    least: the surface passes it, and there is no telling when.
    """
    values = coded((1 - share) * value_of(before) + share * value_of(after))
    least = np.minimum(before, after)
    occupied = np.maximum(before, after) >= EMPTY
    passed = (before == EMPTY) | (after == EMPTY)
    return np.asarray(np.where(passed, EMPTY, np.where(occupied, values, least)), np.uint8)


def interpolated(codes: NDArray[np.uint8], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values at places (M, 3), x, y, z in cells from the corner of a grid, between the middles of cells."""
    first = np.floor(places - 0.5).astype(np.int64)
    share = places - 0.5 - first
    total = np.zeros(len(places))
    for step in itertools.product((0, 1), repeat=3):
        x, y, z = np.clip(first + step, 0, len(codes) - 1).T
        total += np.prod(np.where(step, share, 1 - share), axis=1) * value_of(codes[z, y, x])
    return total
