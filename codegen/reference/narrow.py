"""Where level 1's band may be narrower than its half width: a small grid of widths, in Shadertoy's texts.

The half width of a band is what the worst place of the shape needs. Elsewhere level 1 is nearer to the surface, and
rays may be traced by it alone for longer.
"""

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .cell_codes import OVERESTIMATE
from .interpret import field
from .lowest import near_surface, on_surface
from .march import OFFSET

SHARES = 15
"""Widths are whole multiples of the half width over this, at least LEAST of them."""
LEAST = 4
"""Of SHARES: with less, a ray could stop in small pictures where it should enter the band."""


def narrow_widths(program: Program, count: int) -> NDArray[np.uint8] | None:
    """Return the band's half width in the cells of the cube from -1 to 1, (count, count, count), index [z, y, x].

    Each is a multiple of the half width over SHARES: OFFSET times the largest |f_1| on the surfaces of the finer
    levels, in the cell and as far around as the band's spheres reach. None where there is no such surface. The program
    is that of one model of several levels, whose field does not move.
    """
    largest, delta = np.zeros((count,) * 3), program.bands[0].delta
    found = False
    for level in range(2, len(program.bands) + 1):
        finer = replace(program, values=program.values[:level], gradients=program.gradients[:level])
        finer = replace(finer, bands=program.bands[:level])
        points = on_surface(finer, near_surface(finer))
        found = found or len(points) > 0
        sizes = np.abs(field(program, points, 1))
        for way in itertools.product((-1, 0, 1), repeat=3):
            x, y, z = _cells(points + OVERESTIMATE * delta * np.array(way), count).T
            np.maximum.at(largest, (z, y, x), sizes)
    shares = np.clip(np.ceil(SHARES * OFFSET / delta * largest), LEAST, SHARES)
    return shares.astype(np.uint8) if found else None


def half_widths(program: Program, shares: NDArray[np.uint8] | None, points: Array) -> NDArray[np.float64]:
    """Return the half widths (N,) of level 1's band at points (N, 3).

    shares: of `narrow_widths`; None where the half width is the same everywhere.
    """
    delta = program.bands[0].delta
    if shares is None:
        return np.full(len(points), delta)
    x, y, z = _cells(points, len(shares)).T
    return np.asarray(shares[z, y, x] * (delta / SHARES))


def _cells(points: NDArray[np.floating], count: int) -> NDArray[np.int64]:
    """Return the cells (N, 3) that points (N, 3) are in, or next to."""
    return np.asarray(np.clip(np.floor((points + 1) * (count / 2)), 0, count - 1), np.int64)
