"""Small grids of band half-widths, for shaders of one file: bands are narrower than delta where the shape allows it.

The worst place of the shape determines delta. Elsewhere rays stay longer at the coarser level.
"""

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from ..model.model import DELTA_FACTOR
from .cell_codes import OVERESTIMATE
from .interpret import field
from .surface_points import LAST, crossed_cells, on_surface

SHARES = 15
"""A half width is a whole multiple, at least LEAST, of delta over SHARES."""
LEAST = 4
"""Narrower bands would stop some rays of small pictures before they enter the band."""
STARTS = 4
"""Start points in a cell of the finest search. One point alone misses the largest |f_i| of thin parts, and with it one
ray of 10,000 (benchmarks/frames.py)."""

Grid = NDArray[np.uint8]
"""Half widths of a level's band in the cells of [-1, 1]^3, (N, N, N), index [z, y, x], in multiples of delta /
SHARES."""


def narrow_widths(program: Program, count: int) -> tuple[Grid, ...]:
    """Return a grid with `count` cells along an edge for the band of each level before the last.

    A half width is DELTA_FACTOR times the largest |f_i| on the surfaces of the finer levels, in the cell and in its
    surroundings up to the reach of the band's spheres. Returns no grids if a finer level has no surface. The program
    must be of one model of several levels, and must not move.
    """
    levels = len(program.bands)
    largest = np.zeros((levels - 1, count, count, count))
    for finest in range(2, levels + 1):
        points = _surface(program, finest)
        if not len(points):
            return ()
        for level in range(1, finest):
            sizes = np.abs(field(program, points, level))
            reach = OVERESTIMATE * program.bands[level - 1].delta
            for direction in itertools.product((-1, 0, 1), repeat=3):
                x, y, z = cells_of(points + reach * np.array(direction), count).T
                np.maximum.at(largest[level - 1], (z, y, x), sizes)
    deltas = np.array([band.delta for band in program.bands[:-1]])[:, None, None, None]
    return tuple(np.clip(np.ceil(SHARES * DELTA_FACTOR / deltas * largest), LEAST, SHARES).astype(np.uint8))


def cells_of(points: NDArray[np.floating], count: int) -> NDArray[np.int64]:
    """Return the cells (N, 3) of [-1, 1]^3 that hold points (N, 3), or the nearest cells."""
    return np.asarray(np.clip(np.floor((points + 1) * (count / 2)), 0, count - 1), np.int64)


def _surface(program: Program, level: int) -> Array:
    """Return points (N, 3) of a level's surface, from STARTS points in each cell that it may cross."""
    part = replace(
        program, values=program.values[:level], gradients=program.gradients[:level], bands=program.bands[:level]
    )
    centers = crossed_cells(part)
    offsets = np.random.default_rng(0).uniform(-1, 1, (STARTS - 1, *centers.shape)) * (1 + part.bands[0].delta) / LAST
    return on_surface(part, np.concatenate([centers, *(centers + offsets)], dtype=np.float32))
