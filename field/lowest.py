"""The lowest point of a model's surface, on which the studio's floor lies (glsl/openness.glsl)."""

import numpy as np

from ..ir.program import Array, Program
from .cell_codes import OVERESTIMATE, all_cells, cut_in_eight, middles
from .interpret import field_gradient, nested_field

FIRST, LAST = 16, 64
"""Cells along an edge of the grids that the search begins and ends with; each is twice as fine as the one before."""
TIMES = 9
"""Instants of [0, 1] at which a field that moves is looked at."""
CHUNK = 2048
"""Points that are moved onto the surface at a time, the lowest ones first."""


def lowest_point(program: Program) -> float:
    """Return the height, along the y axis of model space, of the lowest point of the last level's surface.

    Of a field that moves it is the lowest at any of TIMES instants. Without a surface in the unit ball it is -1.
    """
    times = np.linspace(0, 1, TIMES) if program.moving else np.zeros(1)
    return min(_lowest(program, float(time)) for time in times)


def _lowest(program: Program, time: float) -> float:
    points = near_surface(program, time)
    points = points[np.argsort(points[:, 1])]
    for part in np.array_split(points, 1 + len(points) // CHUNK):
        there = on_surface(program, part, time)
        if len(there):
            return float(there[:, 1].min())
    return -1.0


def on_surface(program: Program, points: Array, time: float = 0.0) -> Array:
    """Move points (N, 3) onto the last level's surface. Returns (M, 3): those that have got there, not far out."""
    at, value = points, np.zeros(len(points), np.float32)
    for _ in range(4):  # Newton's steps
        gradient, value = field_gradient(program, at, len(program.bands), time)
        at = at - (value / np.maximum((gradient**2).sum(axis=1), 0.25))[:, None] * gradient
    there = (np.abs(value) < 1e-3) & (np.linalg.norm(at, axis=1) < 1.1)
    return np.asarray(at[there], np.float32)


def near_surface(program: Program, time: float = 0.0) -> Array:
    """Return the centres (N, 3) of the cells of a grid that the last level's surface may cross."""
    cells, edge = all_cells(FIRST), FIRST
    deltas = [band.delta for band in program.bands]
    half = 1.0 + deltas[0]
    while True:
        points = middles(cells, edge, half)
        reach = OVERESTIMATE * np.sqrt(3) * half / edge
        value, reached = nested_field(program, points, len(deltas), time, margins=[reach] * (len(deltas) - 1))
        near = (reached == len(deltas)) & (np.abs(value) < reach)
        if edge == LAST:
            return np.asarray(points[near])
        cells, edge = cut_in_eight(cells[near]), 2 * edge
