"""Points on the last level's surface, and near it."""

import numpy as np

from ..ir.program import Array, Program
from .cell_codes import OVERESTIMATE, all_cells, cut_in_eight, middles
from .interpret import field, field_gradient, nested_field

FIRST, LAST = 16, 64
"""Cells along an edge of the coarsest and the finest grid of `crossed_cells`; each grid is twice as fine as the
last."""
POINTS = 4000
"""Random points from which `near_surface` starts."""


def newton(program: Program, points: Array, steps: int, time: float = 0.0) -> tuple[Array, Array]:
    """Move points (N, 3) towards the surface by Newton's method. Returns them, and f before the last step (N,)."""
    value = np.zeros(len(points), np.float32)
    for _ in range(steps):
        gradient, value = field_gradient(program, points, len(program.bands), time)
        points = points - (value / np.maximum((gradient**2).sum(axis=1), 0.25))[:, None] * gradient
    return points, value


def on_surface(program: Program, points: Array, time: float = 0.0) -> Array:
    """Move points (N, 3) onto the surface. Returns the points (M, 3) that arrive, without those far outside."""
    moved, value = newton(program, points, 4, time)
    arrived = (np.abs(value) < 1e-3) & (np.linalg.norm(moved, axis=1) < 1.1)
    return np.asarray(moved[arrived], np.float32)


def in_last_band(program: Program, points: Array) -> Array:
    """Return the points (M, 3) of (N, 3) with |f| < delta of the last level."""
    last = len(program.bands)
    return np.asarray(points[np.abs(field(program, points, last)) < program.bands[-1].delta])


def near_surface(program: Program) -> Array:
    """Return at most POINTS points (N, 3) float32 in [-1, 1]^3 and in the last level's band, at time 0."""
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (POINTS, 3)).astype(np.float32)
    points = in_last_band(program, newton(program, points, 4)[0])
    return np.asarray(points[np.abs(points).max(axis=1) < 1])


def crossed_cells(program: Program, time: float = 0.0) -> Array:
    """Return the centers (N, 3) of the cells of a grid that the last level's surface may cross."""
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
