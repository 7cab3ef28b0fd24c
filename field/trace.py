"""Intersects any rays with the surface of a model, to a precision that does not depend on pixels."""

import math

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array
from ..model.model import DELTA_FACTOR, Model
from .evaluate import Evaluator

Doubles = NDArray[np.float64]

NEAR = 1e-6
"""Largest f at which a ray has reached the surface, model units: some ten times the resolution of float32."""
LEAST = 2e-4
"""Smallest step, model units. A step that enters the shape is bisected."""
STEPS = 1000
"""Largest number of steps of a ray."""


def enter_ball(origins: Doubles, directions: Doubles, radius: float) -> tuple[Doubles, Doubles, NDArray[np.bool_]]:
    """Intersect rays with the ball of a radius around the origin.

    origins: (N, 3) or (3,); directions: (N, 3) of length 1. Returns the distances (N,) at which the rays enter, at
    least 0, and leave, and whether they meet the ball (N,).
    """
    along = (origins * directions).sum(axis=1)
    discriminant = along**2 - (origins * origins).sum(axis=-1) + radius**2
    half = np.sqrt(np.maximum(discriminant, 0))
    return np.maximum(-along - half, 0), half - along, (discriminant > 0) & (half > along)


def trace(
    model: Model,
    evaluator: Evaluator,
    origins: Doubles,
    directions: Doubles,
    level: int,
    time: float = 0.0,
    near: float = NEAR,
) -> Doubles:
    """Sphere trace rays (Hart 1996) through the nested bands (Section 3.2) to the surface f_level = 0.

    evaluator: of the model. origins, directions: (N, 3), model space, directions of length 1. time: the fourth input of
    a moving model. near: largest f of a hit, at least NEAR, model units. Returns the distances (N,) to the surface,
    infinity for rays that miss it, and 0 for rays that begin inside the shape. The search ends at the ball of radius 1
    + delta_level.
    """
    bands = np.array([entry.delta / DELTA_FACTOR for entry in model.levels])
    bands[level - 1] = 0.0
    factors = np.array([entry.band_step_bound for entry in model.levels])
    factors[level - 1] = model.levels[level - 1].step_bound
    radius = 1.0 + model.levels[level - 1].delta

    def field(rays: Doubles, t: Doubles) -> tuple[Array, NDArray[np.int64]]:
        return evaluator.nested((rays[:, :3] + t[:, None] * rays[:, 3:]).astype(np.float32), level, time)

    def work(rays: Doubles) -> Doubles:
        t, far, meets = enter_ball(rays[:, :3], rays[:, 3:], radius)
        hits, outside = np.full(len(rays), np.inf), t.copy()
        active = np.flatnonzero(meets)
        crossed = [np.zeros(0, np.int64)]
        for _ in range(STEPS):
            if not len(active):
                break
            f, reached = field(rays[active], t[active])
            inside = (f < 0) & (t[active] > outside[active])
            crossed.append(active[inside])
            arrived = (f <= near) & ~inside
            hits[active[arrived]] = t[active[arrived]]
            going = f > near
            active, f, reached = active[going], f[going], reached[going]
            outside[active] = t[active]
            t[active] += np.maximum(factors[reached - 1] * (f - bands[reached - 1]), max(near, LEAST))
            active = active[t[active] < far[active]]
        through = np.concatenate(crossed)
        low, high = outside[through], t[through]
        for _ in range(math.ceil(math.log2(1 / near)) + 4):
            middle = (low + high) / 2
            positive = field(rays[through], middle)[0] > 0
            low, high = np.where(positive, middle, low), np.where(positive, high, middle)
        hits[through] = high
        return hits

    return evaluator.over(np.concatenate([origins, directions], axis=1), work, (), np.float64)
