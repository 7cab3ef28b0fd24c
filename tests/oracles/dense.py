"""Dense marching of the last level alone, in numpy: what multiscale sphere tracing is checked against."""

import numpy as np
from numpy.typing import NDArray

from mplicits.field.interpret import nested_field
from mplicits.ir.program import Array, Program
from oracles.march import ball

SMALLEST, LARGEST = 0.0006, 0.05
"""Limits of a step, model units: small against the thinnest feature, and large enough to get through the ball."""


def dense_march(
    program: Program, origin: NDArray[np.float64], directions: NDArray[np.float64], level: int, footprint: float
) -> tuple[Array, Array]:
    """Follow rays through the ball in short steps, up to the surface f_level = 0.

    origin: (3,), of all rays; directions: (N, 3) of length 1, model space. footprint: width of a pixel at distance 1.
    Returns how close each ray comes to the surface, in pixels, (N,), and the distance at which it ends, (N,). A ray
    that meets the surface comes as close as 0 and ends there; one that stays outside the last band comes as close as
    infinity. A step is 0.3 of the distance that the finest defined level gives: its gradient may be longer than 1.
    """
    t, far, meets = ball(origin, directions, 1.0 + program.bands[level - 1].delta)
    offsets = np.array([*(band.delta for band in program.bands[: level - 1]), 0.0])
    closest = np.full(len(directions), np.inf)
    active = np.flatnonzero(meets)
    while len(active):
        points = (origin + t[active, None] * directions[active]).astype(np.float32)
        value, reached = nested_field(program, points, level)
        pixels = np.where(reached == level, np.maximum(value, 0) / (footprint * t[active]), np.inf)
        closest[active] = np.minimum(closest[active], pixels)
        moving = pixels > 0
        active, value, reached = active[moving], value[moving], reached[moving]
        t[active] += np.clip(0.3 * (np.abs(value) - offsets[reached - 1]), SMALLEST, LARGEST)
        active = active[t[active] < far[active]]
    return closest.astype(np.float32), t.astype(np.float32)
