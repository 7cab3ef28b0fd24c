"""A convex hull of thirteen pairs of parallel planes, outside of which rays miss a shape (enter_hull.glsl)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Program
from .cell_codes import EMPTY, middles
from .cells import Cells

NUMBERS = range(14, 27)
"""Each number, in three digits of base 3, less 1 each, is one direction; the set has all directions but for sign."""
NORMALS = np.array([(k % 3 - 1, k // 3 % 3 - 1, k // 9 - 1) for k in NUMBERS], np.float64)
"""(13, 3): directions of the axes and the diagonals, of any length."""
BALL = 1.02
"""Radius of the ball in which rays are traced; the field was not trained outside."""
DIGITS = 2
"""Decimals of a plane's offset, which is rounded outwards."""


def hull(program: Program) -> NDArray[np.float64]:
    """Return the least and the greatest NORMALS @ p (13, 2) of points p on the surfaces of all levels in the ball.

    The program must be of one model and must not move.
    """
    low, high = np.full(len(NORMALS), np.inf), np.full(len(NORMALS), -np.inf)
    for level in range(1, len(program.bands) + 1):
        cells = Cells(replace(program, values=program.values[:level], bands=program.bands[:level]))
        z, y, x = np.nonzero(cells.grid() >= EMPTY)
        points = middles(np.stack([x, y, z], axis=1), cells.count, cells.half)
        edge = cells.half / cells.count
        along = points[np.linalg.norm(points, axis=1) < BALL + np.sqrt(3) * edge] @ NORMALS.T
        corner = edge * np.abs(NORMALS).sum(axis=1)
        low = np.minimum(low, along.min(axis=0, initial=1.0) - corner)
        high = np.maximum(high, along.max(axis=0, initial=-1.0) + corner)
    scale = 10**DIGITS
    return np.asarray(np.stack([np.floor(low * scale), np.ceil(high * scale)], axis=1) / scale)
