"""Random points: in a band around the surface (Fig. 3a), in the domain, in the unit ball."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from .shapes.shape import Doubles

Distance = Callable[[Doubles], Doubles]
"""Points (N, 3) -> distances (N,)."""
Mask = Callable[[Doubles], NDArray[np.bool_]]
"""Points (N, 3) -> mask (N,)."""

ROUNDS = 200
"""Most rounds of dithering; each draws at least four times the missing number of points."""


def dithered(points: Doubles, delta: float, inside: Mask, count: int, rng: np.random.Generator) -> Doubles:
    """Draw `count` points of the band around the surface by dithering with rejection (Fig. 3a).

    Each coordinate of a surface point is shifted within (-2 delta, 2 delta); points outside the band are rejected.
    points: (N, 3), on the surface, or (N, 4) with a time, which stays. inside: mask of the points in the band,
    |f_{i-1}| < delta. Returns as many columns. Raises UserError where too few points are in the band.
    """
    kept: list[Doubles] = []
    missing = count
    for _ in range(ROUNDS):
        drawn = points[rng.integers(len(points), size=max(4 * missing, 1024))]
        drawn = shifted(drawn, rng.uniform(-2 * delta, 2 * delta, (len(drawn), 3)))
        kept.append(drawn[inside(drawn)][:missing])
        missing -= len(kept[-1])
        if not missing:
            return np.concatenate(kept)
    raise UserError(
        f"the band of half-width {delta:.2g} has too few sample points: the level before missed the surface; "
        "train that level longer or change --omega"
    )


def ball(count: int, radius: float, rng: np.random.Generator) -> Doubles:
    """Draw uniform points of the ball around the origin. Returns (count, 3)."""
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.asarray(directions * (radius * np.cbrt(rng.random(count)))[:, None])


def corners(count: int, radius: float, rng: np.random.Generator) -> Doubles:
    """Draw uniform points of the domain outside a ball, whose radius is at most 1.2. Returns (count, 3)."""
    drawn = np.empty((0, 3))
    while len(drawn) < count:
        points = domain(4 * count, rng)
        drawn = np.concatenate((drawn, points[np.linalg.norm(points, axis=1) > radius]))
    return drawn[:count]


def timed(points: Doubles, moving: bool, rng: np.random.Generator) -> Doubles:
    """Add a uniform time in [0, 1] to points (N, 3) where the shape moves; else return them unchanged."""
    return np.column_stack((points, rng.random(len(points)))) if moving else points


def shifted(points: Doubles, offsets: Doubles) -> Doubles:
    """Shift points (N, 3), or (N, 4) with a time, which stays, by offsets (N, 3)."""
    moved = points.copy()
    moved[:, :3] += offsets
    return moved


def domain(count: int, rng: np.random.Generator) -> Doubles:
    """Draw `count` uniform points of the domain Omega, the cube [-1, 1]^3. Returns (count, 3)."""
    return rng.uniform(-1, 1, (count, 3))
