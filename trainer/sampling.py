"""Where the loss is sampled: along the surface's normals (Fig. 3b), in the band around it (Fig. 3a), in the domain."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from .shapes.shape import Doubles

Distance = Callable[[Doubles], Doubles]
"""Points (N, 3) -> distances (N,)."""
Mask = Callable[[Doubles], NDArray[np.bool_]]
"""Points (N, 3) -> which of them to keep (N,)."""

REDUCTIONS = 10
"""Small steps in which t_j goes from the band's half width down to zero."""
TOLERANCE = 0.01
"""Share by which the distance to the surface may fall short of t_j: facets and sampled clouds are not smooth."""
ROUNDS = 200
"""Most rounds of dithering; each draws at least four times as many points as are still missing."""


def offsets(points: Doubles, directions: Doubles, largest: float, clearance: Distance) -> Doubles:
    """Find how far each point of the surface may move along its normal and stay the nearest one (Fig. 3b).

    points: (N, 3). directions: (N, 3), unit normals, or their opposites to go inside. clearance: gives the unsigned
    distance to the surface. Returns t (N,): the largest t_j <= `largest`, in steps of a tenth of it, at which
    points_j + t_j directions_j is at distance t_j; 0 where no step fits.
    """
    t = np.full(len(points), largest)
    short = np.arange(len(points))
    for k in range(REDUCTIONS - 1, -1, -1):
        distance = clearance(points[short] + t[short, None] * directions[short])
        short = short[distance < t[short] * (1 - TOLERANCE)]
        if not len(short):
            break
        t[short] = largest * k / REDUCTIONS
    return t


def dithered(points: Doubles, delta: float, inside: Mask, count: int, rng: np.random.Generator) -> Doubles:
    """Draw `count` points of the band around the surface, by dithering with rejection (Fig. 3a).

    Each coordinate of a point of the surface is perturbed within (-2 delta, 2 delta), and the result is rejected
    outside the band. points: (N, 3), on the surface, or (N, 4) with a time, which stays. inside: tells which points
    are in the band, |f_{i-1}| < delta. Returns as many columns. Raises UserError where the band is hit too rarely.
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
        f"the band of half width {delta:.2g} is hit too rarely: the level before it missed the surface; "
        "train it longer or change --omega"
    )


def ball(count: int, radius: float, rng: np.random.Generator) -> Doubles:
    """Draw uniform points of the ball around the origin. Returns (count, 3)."""
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.asarray(directions * (radius * np.cbrt(rng.random(count)))[:, None])


def corners(count: int, radius: float, rng: np.random.Generator) -> Doubles:
    """Draw uniform points of the domain outside the ball of a radius of at most 1.2. Returns (count, 3)."""
    drawn = np.empty((0, 3))
    while len(drawn) < count:
        points = domain(4 * count, rng)
        drawn = np.concatenate((drawn, points[np.linalg.norm(points, axis=1) > radius]))
    return drawn[:count]


def timed(points: Doubles, moving: bool, rng: np.random.Generator) -> Doubles:
    """Give points (N, 3) a fourth coordinate, a uniform time in [0, 1], where the shape moves; else return them."""
    return np.column_stack((points, rng.random(len(points)))) if moving else points


def shifted(points: Doubles, offsets: Doubles) -> Doubles:
    """Move points (N, 3), or (N, 4) whose time stays, by offsets (N, 3)."""
    moved = points.copy()
    moved[:, :3] += offsets
    return moved


def domain(count: int, rng: np.random.Generator) -> Doubles:
    """Draw `count` uniform points of the domain Omega, the cube [-1, 1]^3. Returns (count, 3)."""
    return rng.uniform(-1, 1, (count, 3))
