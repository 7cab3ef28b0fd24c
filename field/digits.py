"""The fewest decimals that the weights of a model need as text."""

import math

import numpy as np

from ..ir.at_time import at_sampled_times
from ..ir.lower import lower
from ..ir.program import Array, Program
from ..model.model import Model
from . import interpret

SHARE = 0.05
"""The error that rounding may make, as a share of the last level's delta: the finest detail that a model claims."""
MOST = 7
"""Decimals that no model needs more of."""
POINTS = 4000
"""Random points from which `near_surface` starts."""


def fewest_digits(model: Model) -> int:
    """Return the fewest decimals whose root mean square error near the surface is under SHARE of the last delta.

    Of a model that moves, they are enough at each of the times that `at_sampled_times` samples.
    """
    moments = [(exact, near_surface(exact)) for exact in at_sampled_times(lower(model))]
    allowed = SHARE * model.levels[-1].delta

    def enough(digits: int) -> bool:
        rounded = at_sampled_times(lower(model, digits))
        errors = (error(exact, few, points) for (exact, points), few in zip(moments, rounded, strict=True))
        return all(one < allowed for one in errors)

    return next((digits for digits in range(1, MOST) if enough(digits)), MOST)


def error(exact: Program, rounded: Program, points: Array) -> float:
    """Return the root mean square difference of two programs' last levels at points (N, 3) float32, model units.

    It is infinite without points: nothing tells then what rounding costs.
    """
    if not len(points):
        return math.inf
    level = len(exact.bands)
    difference = interpret.field(exact, points, level) - interpret.field(rounded, points, level)
    return float(np.sqrt(np.mean(np.square(difference, dtype=np.float64))))


def near_surface(program: Program) -> Array:
    """Return points (N, 3) float32 in the last level's band: random ones, moved to the surface by Newton's method.

    Of a program that moves, they are those of time 0. N is at most POINTS: points that do not arrive, or leave
    [-1, 1]^3, are left out.
    """
    level = len(program.bands)
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (POINTS, 3)).astype(np.float32)
    for _ in range(4):
        gradient, value = interpret.field_gradient(program, points, level)
        points -= (value / np.maximum(np.square(gradient).sum(axis=1), 0.25))[:, None] * gradient
    arrived = np.abs(interpret.field(program, points, level)) < program.bands[-1].delta
    inside: Array = points[arrived & (np.abs(points).max(axis=1) < 1)]
    return inside
