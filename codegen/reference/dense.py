"""Dense marching of the last level alone, in numpy: what multiscale sphere tracing is checked against."""

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .interpret import nested_field
from .march import ball

SMALLEST, LARGEST = 0.0006, 0.05
"""Steps, model units: small against the thinnest feature, and so that the way through the ball ends."""


def dense_march(
    program: Program, origin: NDArray[np.float64], directions: NDArray[np.float64], level: int, pixel: float
) -> tuple[Array, Array]:
    """How close each ray comes to f_level = 0 inside the ball, in pixels, and where it stops: (N,) each.

    origin: (3,), directions: (N, 3) of length 1, model space; pixel: width of a pixel at distance 1.
    A ray that meets the surface comes as close as 0 and stops there. Steps are 0.3 of the distance that the finest
    defined level gives: no trust in its gradient's length.
    """
    t, far, meets = ball(origin, directions, 1.0 + program.bands[level - 1].delta)
    offsets = np.array([*(band.delta for band in program.bands[: level - 1]), 0.0])
    closest = np.full(len(directions), np.inf)
    active = np.flatnonzero(meets)
    while len(active):
        points = (origin + t[active, None] * directions[active]).astype(np.float32)
        value, reached = nested_field(program, points, level)
        pixels = np.where(reached == level, np.maximum(value, 0) / (pixel * t[active]), np.inf)
        closest[active] = np.minimum(closest[active], pixels)
        on = pixels > 0
        active, value, reached = active[on], value[on], reached[on]
        t[active] += np.clip(0.3 * (np.abs(value) - offsets[reached - 1]), SMALLEST, LARGEST)
        active = active[t[active] < far[active]]
    return closest.astype(np.float32), t.astype(np.float32)
