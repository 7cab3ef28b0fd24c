"""The lowest point of a model's surface, where the floor lies (glsl/functions/openness.glsl)."""

import numpy as np

from ..ir.program import Program
from .surface_points import crossed_cells, on_surface

TIMES = 9
"""Number of times in [0, 1] at which a moving field is evaluated."""
CHUNK = 2048
"""Number of points, the lowest first, that are moved onto the surface together."""


def lowest_point(program: Program) -> float:
    """Return the smallest y of the last level's surface, model space; of a moving field, at any of TIMES times.

    Returns -1 without a surface in the unit ball.
    """
    times = np.linspace(0, 1, TIMES) if program.moving else np.zeros(1)
    return min(_lowest(program, float(time)) for time in times)


def _lowest(program: Program, time: float) -> float:
    points = crossed_cells(program, time)
    points = points[np.argsort(points[:, 1])]
    for part in np.array_split(points, 1 + len(points) // CHUNK):
        surface = on_surface(program, part, time)
        if len(surface):
            return float(surface[:, 1].min())
    return -1.0
