"""Where the loss is sampled: along the surface's normals (Fig. 3b), in the band around it (Fig. 3a), everywhere."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from .shapes.shape import Doubles

Distance = Callable[[Doubles], Doubles]
Mask = Callable[[Doubles], NDArray[np.bool_]]

REDUCTIONS = 10
"""Small steps in which t_j goes from the band's half width down to zero."""
TOLERANCE = 0.01
"""Share by which the distance to the surface may fall short of t_j: facets and sampled clouds are not smooth."""
ROUNDS = 200


def offsets(points: Doubles, directions: Doubles, largest: float, clearance: Distance) -> Doubles:
    """t_j of Fig. 3b: the largest t_j <= `largest` at which points_j + t_j directions_j is at distance t_j. (n,)

    directions: (n, 3) unit normals, or their opposites to go inside. clearance: unsigned distance to the surface at
    (m, 3) points. Where no step down to zero fits, t_j is 0.
    """
    t = np.full(len(points), largest)
    left = np.arange(len(points))
    for k in range(REDUCTIONS - 1, -1, -1):
        reached = clearance(points[left] + t[left, None] * directions[left])
        left = left[reached < t[left] * (1 - TOLERANCE)]
        if not len(left):
            break
        t[left] = largest * k / REDUCTIONS
    return t


def dithered(points: Doubles, delta: float, inside: Mask, count: int, rng: np.random.Generator) -> Doubles:
    """`count` points of the band by Fig. 3a: every coordinate perturbed within (-2 delta, 2 delta), rejected outside.

    points: (n, 3) on the surface. inside: |f_{i-1}(x)| < delta at (m, 3) points. Raises UserError where the band is
    (nearly) never hit.
    """
    kept: list[Doubles] = []
    missing = count
    for _ in range(ROUNDS):
        drawn = points[rng.integers(len(points), size=max(4 * missing, 1024))]
        drawn = drawn + rng.uniform(-2 * delta, 2 * delta, drawn.shape)
        kept.append(drawn[inside(drawn)][:missing])
        missing -= len(kept[-1])
        if not missing:
            return np.concatenate(kept)
    raise UserError(
        f"the band of half width {delta:.2g} is hit too rarely: the level before it missed the surface; "
        "train it longer or change --omega"
    )


def domain(count: int, rng: np.random.Generator) -> Doubles:
    """Uniform points of the domain Omega, the cube [-1, 1]^3. (count, 3)"""
    return rng.uniform(-1, 1, (count, 3))
