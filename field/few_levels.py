"""A grid of few cells with few levels of values, as shaders of one file have in their text (cells.py)."""

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Program
from .cell_codes import EMPTY, OVERESTIMATE, REACH, all_cells, coded, interpolated, middles, value_of
from .cell_search import CHUNK, MISSED, found_grid, largest_around
from .interpret import nested_field

FEW_LEVELS = 15
"""Levels of the values of a grid with `few` of them: with that of empty cells, 4 bits hold a cell."""
FINE = 64
"""Cells along an edge of the grid whose middles a grid with few cells is checked at: cells as large as its own would
miss what is thin."""
TRUSTED = 0.5
"""Share of a band's half width beyond which, outside of the band, no residual is asked there: it was trained within."""
ROUNDS = 12
"""How often such a grid is checked, and lowered where it gave too much."""


def few_grid(program: Program, count: int, half: float, slack: float = 0.0) -> NDArray[np.uint8]:
    """Return what Cells.grid does with few levels: what `found_grid` finds, lowered where finer cells know better."""
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
        between = interpolated(codes, places)
        wrong = (between > 0) & (between > least)
        if not wrong.any():
            break
        excess = (between - least)[wrong].astype(np.float32)
        lowered = largest_around(first[wrong], excess, count)
        less = _of_few_levels(coded(value_of(codes) - MISSED * lowered))
        codes = np.where(lowered > 0, less, codes)
    return codes


def _trusted(program: Program, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Evaluate all levels at points (N, 3), far from the surface, too.

    A residual is asked no farther than TRUSTED half widths beyond its band; elsewhere a positive value is that of the
    coarser level less its half width.
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
    """Return bytes of which those of empty cells are 0, and the others the next lower one of FEW_LEVELS."""
    most = FEW_LEVELS - 1
    lower = (codes.astype(np.int64) - EMPTY) * most // (255 - EMPTY)
    return np.where(codes < EMPTY, 0, EMPTY + lower * (255 - EMPTY) // most).astype(np.uint8)
