"""The smallest number of decimals for the weights of a model as text."""

import math

import numpy as np

from ..ir.at_time import at_sampled_times
from ..ir.lower import lower
from ..ir.program import Array, Program
from ..model.model import Model
from . import interpret
from .surface_points import near_surface

SHARE = 0.05
"""Allowed rounding error, as a share of the last level's delta, which is the finest detail of a model."""
MOST = 7
"""Decimals that suffice for every model."""


def fewest_digits(model: Model) -> int:
    """Return the fewest decimals whose root mean square error near the surface is below SHARE of the last delta.

    For a moving model, the error is below it at each of the times of `at_sampled_times`.
    """
    exact = [(program, near_surface(program)) for program in at_sampled_times(lower(model))]
    allowed = SHARE * model.levels[-1].delta

    def enough(digits: int) -> bool:
        rounded = at_sampled_times(lower(model, digits))
        return all(
            error(program, other, points) < allowed for (program, points), other in zip(exact, rounded, strict=True)
        )

    return next((digits for digits in range(1, MOST) if enough(digits)), MOST)


def error(exact: Program, rounded: Program, points: Array) -> float:
    """Return the root mean square difference of two programs at points (N, 3), model units; infinity without points."""
    if not len(points):
        return math.inf
    level = len(exact.bands)
    difference = interpret.field(exact, points, level) - interpret.field(rounded, points, level)
    return float(np.sqrt(np.mean(np.square(difference, dtype=np.float64))))
