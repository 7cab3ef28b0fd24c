"""A small moving model without training: a textured ball that splits into two."""

import numpy as np
from numpy.typing import NDArray

from mplicits.model.model import Model
from support.fitted_model import evaluate, fit, levels_of

Array = NDArray[np.float64]

RADIUS = 0.42
"""Of each ball, model units."""
BLEND = 0.12
"""Distance over which the two balls blend, model units."""
COMPARED_TIMES = (0.0, 0.35, 0.6, 1.0)
"""Times of pictures: one ball, a waist, two balls just apart, two balls far apart."""


def center(time: Array) -> Array:
    """Compute the distance of the balls' centers from the origin along x: 0 at time 0."""
    return 0.55 * time


def distance(points: Array) -> Array:
    """Compute the smooth union of the two balls' distances at (x, y, z, t), (N, 4). Returns (N,)."""
    away = np.stack([center(points[:, 3]), np.zeros(len(points)), np.zeros(len(points))], axis=1)
    left, right = (np.linalg.norm(points[:, :3] - side * away, axis=1) - RADIUS for side in (-1, 1))
    melted = np.maximum(BLEND - np.abs(left - right), 0) / BLEND
    return np.asarray(np.minimum(left, right) - 0.25 * BLEND * melted**2, float)


def colors(points: Array) -> Array:
    """Compute the colors, sRGB, at (x, y, z, t), (N, 4): stripes that fade into each ball's color. Returns (N, 3)."""
    x, time = points[:, :1], points[:, 3:]
    sides = 0.5 + 0.5 * np.tanh(3 * x)
    own = sides * np.array([[0.9, 0.5, 0.2]]) + (1 - sides) * np.array([[0.2, 0.55, 0.85]])
    stripes = 0.55 + 0.3 * np.sin(6 * points[:, 1:2]) * np.ones((1, 3))
    return np.asarray((1 - time) * stripes + time * own, float)


def moving_model(widths: tuple[int, int] = (40, 64)) -> Model:
    """Fit two levels of these widths without hidden N -> N layers, and a 16x0 texture, to the ball that splits.

    The deltas are those of Eq. 5 over all times; the step bounds differ, so that a mix-up shows.
    """
    rng = np.random.default_rng(11)
    surface = _on_surface(rng.uniform(-1, 1, (6000, 4)) * (1, 1, 1, 0.5) + (0, 0, 0, 0.5))
    domain = rng.uniform(-1, 1, (6000, 4)) * (1, 1, 1, 0.5) + (0, 0, 0, 0.5)
    points = np.concatenate([surface, domain])
    first = fit(widths[0], 1.6, points, distance(points)[:, None], rng)
    near = np.concatenate([surface] * 2)
    near[:, :3] += rng.normal(0, 0.05, (len(near), 3))
    second = fit(widths[1], 2.5, near, distance(near)[:, None] - evaluate(first, near), rng)
    texture = fit(16, 1.5, surface, colors(surface), rng)
    return Model("splitting", levels_of(first, second, surface), texture, inputs="xyzt")


def _on_surface(points: Array) -> Array:
    """Move points (x, y, z, t), (N, 4), to the surface at their times, by Newton's method along numeric gradients."""
    for _ in range(12):
        value, step = distance(points), 1e-4 * np.eye(4)[:3]
        gradient = np.stack([(distance(points + h) - value) / 1e-4 for h in step], axis=1)
        length = np.maximum(np.square(gradient).sum(axis=1), 0.25)
        points = points - np.pad(gradient * (value / length)[:, None], ((0, 0), (0, 1)))
    arrived: Array = points[np.abs(distance(points)) < 1e-3]
    return arrived
