"""Where rays meet a model's surface: any rays, to a precision of their own, in place of a picture's pixels."""

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array
from ..model.model import Model
from .evaluate import Evaluator
from .narrow import OFFSET

Doubles = NDArray[np.float64]

NEAR = 1e-6
"""A ray is at the surface where f is at most this, model units: some ten times what float32 resolves there."""
LEAST = 2e-4
"""Shortest step; where one leads inside the shape, the way is halved until the surface is found between."""
STEPS = 1000
"""Most steps of a ray."""
HALVINGS = 24
"""Times that a step into the shape is halved: a step of 1 to less than float32 resolves."""


def trace(
    model: Model, evaluator: Evaluator, origins: Doubles, directions: Doubles, level: int, time: float = 0.0
) -> Doubles:
    """Trace rays by spheres (Hart 1996), through the nested bands (Section 3.2), up to the surface f_level = 0.

    evaluator: of the model. origins, directions: (N, 3), model space, directions of length 1. time: the fourth input
    of a model that moves. Returns the distances (N,) at which rays meet the surface, infinity where they do not. A ray
    that begins inside the shape meets it at 0. The shape is looked for in the ball of radius 1 + delta_level.
    """
    bands = np.array([entry.delta / OFFSET for entry in model.levels])
    bands[level - 1] = 0.0
    factors = np.array([entry.band_step_bound for entry in model.levels])
    factors[level - 1] = model.levels[level - 1].step_bound
    radius = 1.0 + model.levels[level - 1].delta

    def field(rays: Doubles, t: Doubles) -> tuple[Array, NDArray[np.int64]]:
        return evaluator.nested((rays[:, :3] + t[:, None] * rays[:, 3:]).astype(np.float32), level, time)

    def work(rays: Doubles) -> Doubles:
        along = (rays[:, :3] * rays[:, 3:]).sum(axis=1)
        discriminant = along**2 - (rays[:, :3] ** 2).sum(axis=1) + radius**2
        half = np.sqrt(np.maximum(discriminant, 0))
        t, far, met = np.maximum(-along - half, 0), half - along, np.full(len(rays), np.inf)
        outside = t.copy()
        active = np.flatnonzero((discriminant > 0) & (far > 0))
        crossed = [np.zeros(0, np.int64)]
        for _ in range(STEPS):
            if not len(active):
                break
            f, reached = field(rays[active], t[active])
            inside = (f < 0) & (t[active] > outside[active])
            crossed.append(active[inside])
            arrived = (f <= NEAR) & ~inside
            met[active[arrived]] = t[active[arrived]]
            going = f > NEAR
            active, f, reached = active[going], f[going], reached[going]
            outside[active] = t[active]
            t[active] += np.maximum(factors[reached - 1] * (f - bands[reached - 1]), LEAST)
            active = active[t[active] < far[active]]
        through = np.concatenate(crossed)
        low, high = outside[through], t[through]
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            positive = field(rays[through], middle)[0] > 0
            low, high = np.where(positive, middle, low), np.where(positive, high, middle)
        met[through] = high
        return met

    return evaluator.over(np.concatenate([origins, directions], axis=1), work, (), np.float64)
