"""Where a level's band may be narrower than its half width: small grids of widths, in the text of single files.

The half width of a band is what the worst place of the shape needs. Elsewhere the level is nearer to the surface, and
rays may be traced by it alone for longer.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .cell_codes import OVERESTIMATE
from .interpret import field
from .lowest import LAST, near_surface, on_surface

OFFSET = 1.3
"""The offset surface of a band is traced where |f_i| is its half width over this (glsl/march.glsl)."""
SHARES = 15
"""Widths are whole multiples of the half width over this, at least LEAST of them."""
LEAST = 4
"""Of SHARES: with less, a ray could stop in small pictures where it should enter the band."""

STARTS = 4
"""Points of a cell of the finest search that are moved onto the surface: with one alone, the largest |f_i| of thin
parts is missed, and one ray of 10,000 with it (benchmarks/frames.py, the paper's widths)."""

Grid = NDArray[np.uint8]
"""The half widths of a level's band in the cells of the cube from -1 to 1, (N, N, N), index [z, y, x], as multiples of
its largest half width over SHARES."""


def narrow_widths(program: Program, count: int) -> tuple[Grid, ...]:
    """Return how wide the bands of the levels before the last are in `count` cells along an edge, a grid for each.

    It is OFFSET times the largest |f_i| on the surfaces of the finer levels, in the cell and as far around as the
    band's spheres reach. There is no grid where a finer level has no surface. The program is that of one model of
    several levels, whose field does not move.
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
            for way in itertools.product((-1, 0, 1), repeat=3):
                x, y, z = _cells(points + reach * np.array(way), count).T
                np.maximum.at(largest[level - 1], (z, y, x), sizes)
    deltas = np.array([band.delta for band in program.bands[:-1]])[:, None, None, None]
    return tuple(np.clip(np.ceil(SHARES * OFFSET / deltas * largest), LEAST, SHARES).astype(np.uint8))


def half_widths(program: Program, grids: Sequence[Grid], points: Array) -> NDArray[np.float64]:
    """Return the half widths (L, N) of all levels' bands at points (N, 3).

    grids: of `narrow_widths`, of the first levels; the bands of the others have one half width everywhere.
    """
    deltas = np.array([band.delta for band in program.bands])
    widths = np.repeat(deltas[:, None], len(points), axis=1)
    for i, grid in enumerate(grids):
        x, y, z = _cells(points, len(grid)).T
        widths[i] *= grid[z, y, x] / SHARES
    return widths


def margins(program: Program, widths: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return what bands of half widths (L, N) are wider by than those of the program, for interpret.nested_levels."""
    return [width - band.delta for width, band in zip(widths[:-1], program.bands, strict=False)]


def _surface(program: Program, level: int) -> Array:
    """Return points (N, 3) of a level's surface: from the middles of cells, and from others in them."""
    upto = replace(
        program, values=program.values[:level], gradients=program.gradients[:level], bands=program.bands[:level]
    )
    middles = near_surface(upto)
    offsets = np.random.default_rng(0).uniform(-1, 1, (STARTS - 1, *middles.shape)) * (1 + upto.bands[0].delta) / LAST
    starts = np.concatenate([middles, *(middles + offsets)], dtype=np.float32)
    return on_surface(upto, starts)


def _cells(points: NDArray[np.floating], count: int) -> NDArray[np.int64]:
    """Return the cells (N, 3) that points (N, 3) are in, or next to."""
    return np.asarray(np.clip(np.floor((points + 1) * (count / 2)), 0, count - 1), np.int64)
