"""A small grid of cells with few distinct values, for the text of shaders of one file (cells.py)."""

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Program
from .cell_codes import EMPTY, OVERESTIMATE, REACH, all_cells, coded, interpolated, middles, value_of
from .cell_search import CHUNK, MISSED, found_grid, largest_around
from .interpret import nested_field

FEW_LEVELS = 15
"""Number of distinct values; with the code of empty cells, 4 bits store a cell."""
FINE = 64
"""Cells along an edge of the grid at whose middles the small grid is checked: its own large cells would miss thin
parts."""
TRUSTED = 0.5
"""Distance outside a band, in delta, up to which residuals are evaluated; they were trained inside the band."""
ROUNDS = 12
"""Largest number of checks, after each of which values that are too large are lowered."""


def few_grid(program: Program, count: int, half: float, slack: float = 0.0) -> NDArray[np.uint8]:
    """Return the grid of `found_grid` with few distinct values, lowered where the field at finer cells is smaller."""
    codes = found_grid(program, count, half, slack)
    fine = all_cells(FINE)
    points = middles(fine, FINE, half)
    truth = _trusted(program, points) - slack
    scale = 0.5 * count / half
    occupied = fine[truth < OVERESTIMATE * np.sqrt(3) * half / FINE] * count // FINE
    z, y, x = occupied.T[::-1]
    codes[z, y, x] = np.where(codes[z, y, x] < EMPTY, 255, codes[z, y, x])
    codes = _of_few_levels(codes)
    near = scale * truth < REACH
    places, least = (fine[near] + 0.5) * (count / FINE), scale * truth[near]
    first = np.floor(places - 0.5).astype(np.int64)
    for _ in range(ROUNDS):
        values = interpolated(codes, places)
        wrong = (values > 0) & (values > least)
        if not wrong.any():
            break
        excess = (values - least)[wrong].astype(np.float32)
        lowered = largest_around(first[wrong], excess, count)
        less = _of_few_levels(coded(value_of(codes) - MISSED * lowered))
        codes = np.where(lowered > 0, less, codes)
    return codes


def _trusted(program: Program, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Evaluate all levels at points (N, 3) at any distance from the surface.

    A residual is evaluated up to TRUSTED delta outside its band; elsewhere a positive value is that of the coarser
    level minus delta.
    """
    deltas = np.array([band.delta for band in program.bands[:-1]], np.float32)
    found = []
    for part in np.array_split(points, 1 + len(points) // CHUNK):
        value, reached = nested_field(program, part, len(program.bands), margins=[*(TRUSTED * deltas)])
        beyond = (reached < len(program.bands)) & (value > 0)
        value[beyond] -= deltas[reached[beyond] - 1]
        found.append(value)
    return np.concatenate(found)


def _of_few_levels(codes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Set the bytes of empty cells to 0, and round the others down to FEW_LEVELS values."""
    most = FEW_LEVELS - 1
    lower = (codes.astype(np.int64) - EMPTY) * most // (255 - EMPTY)
    return np.where(codes < EMPTY, 0, EMPTY + lower * (255 - EMPTY) // most).astype(np.uint8)
