"""Thirteen pairs of planes around a shape: rays outside of them miss it (glsl/enter_hull.glsl)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Program
from .cell_codes import EMPTY, middles
from .cells import Cells
from .march import ball

NUMBERS = range(14, 27)
"""Of the directions: written with three digits of base 3, each less 1, they are all of these but for their sign."""
NORMALS = np.array([(k % 3 - 1, k // 3 % 3 - 1, k // 9 - 1) for k in NUMBERS], np.float64)
"""(13, 3), along the axes and the diagonals, of any length."""
BALL = 1.02
"""Radius of the ball that rays are traced in: farther out, a field was not trained."""
DIGITS = 2
"""Decimals of a plane's place, which is rounded outwards."""


def hull(program: Program) -> NDArray[np.float64]:
    """Return the least and the greatest NORMALS @ p (13, 2) of points p of the surfaces of all levels in the ball.

    The program is that of one model, whose field does not move.
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


def within(
    planes: NDArray[np.float64], origin: NDArray[np.float64], directions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the distances (N,) at which rays enter a hull in the ball, and leave it: none is inside where they cross.

    planes: (13, 2), of `hull`; origin: (3,), of all rays; directions: (N, 3) of length 1, model space.
    """
    speed = directions @ NORMALS.T + 1e-9
    ends = (planes - (NORMALS @ origin)[:, None]) / speed[..., None]
    near, far, meets = ball(origin, directions, BALL)
    return np.maximum(ends.min(axis=2).max(axis=1), near), np.where(
        meets, np.minimum(ends.max(axis=2).min(axis=1), far), -1
    )
