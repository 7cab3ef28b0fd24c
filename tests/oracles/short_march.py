"""Sphere tracing in NumPy, step by step as glsl/functions/shadertoy.glsl, whose text is short."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mplicits.field.half_widths import Grid
from mplicits.field.hull import BALL, NORMALS
from mplicits.field.interpret import nested_field
from mplicits.ir.program import Program
from mplicits.model.model import DELTA_FACTOR
from oracles.march import GAP, Doubles, ball, half_widths, margins

NEAR = 3.0
"""Radius of a free sphere, in gaps, below which a step is over-relaxed."""
STOP = 0.06 / 0.63
"""Distance to the surface at which a ray stops, pixels."""


def within(planes: Doubles, origin: Doubles, directions: Doubles) -> tuple[Doubles, Doubles]:
    """Return the distances (N,) at which rays enter and leave a hull in the ball; enter >= leave: the ray misses.

    planes: (13, 2), from `hull`; origin: (3,); directions: (N, 3) of length 1, model space.
    """
    speed = directions @ NORMALS.T + 1e-9
    ends = (planes - (NORMALS @ origin)[:, None]) / speed[..., None]
    near, far, meets = ball(origin, directions, BALL)
    enter, leave = ends.min(axis=2).max(axis=1), ends.max(axis=2).min(axis=1)
    return np.maximum(enter, near), np.where(meets, np.minimum(leave, far), -1)


@dataclass(eq=False)
class ShortRays:
    """N rays, and the number of evaluations."""

    t: Doubles
    """(N,) distance from the origin."""
    hit: NDArray[np.bool_]
    """(N,) whether the ray has met the surface."""
    steps: NDArray[np.int64]
    """(N,) evaluations of the field, without normals."""
    evaluations: list[int]
    """Evaluations of each level's network, at index level - 1."""


def short_march(
    program: Program,
    origin: Doubles,
    directions: Doubles,
    footprint: float,
    bound: float,
    steps: int = 200,
    planes: Doubles | None = None,
    narrow: Grid | None = None,
) -> ShortRays:
    """Trace the last level along rays from outside of the shape.

    origin: (3,); directions: (N, 3) of length 1, model space. footprint: width of a pixel at distance 1. bound: factor
    on every step. steps: largest number for a ray. planes: (13, 2), from `hull`, or None. narrow: level 1's grid from
    `narrow_widths`, or None.
    """
    levels = len(program.bands)
    if planes is None:
        t, far, meets = ball(origin, directions, BALL)
        far = np.where(meets, far, -1.0)
    else:
        t, far = within(planes, origin, directions)
    rays = ShortRays(t, np.zeros(len(t), np.bool_), np.zeros(len(t), np.int64), [0] * levels)
    before, moved = np.zeros(len(t)), np.ones(len(t))
    active = np.flatnonzero(t < far)
    for _ in range(steps):
        if not len(active):
            break
        points = (origin + t[active, None] * directions[active]).astype(np.float32)
        widths = half_widths(program, () if narrow is None else (narrow,), points)
        value, reached = nested_field(program, points, levels, margins=margins(program, widths))
        for i in range(levels):
            rays.evaluations[i] += int(np.count_nonzero(reached > i))
        rays.steps[active] += 1
        offsets = widths[reached - 1, np.arange(len(points))] / DELTA_FACTOR
        f = value - np.where(reached < levels, offsets, 0)
        stops = np.abs(f) < STOP * footprint * t[active]
        rays.hit[active[stops]] = True
        active, f = active[~stops], bound * f[~stops]
        gap = np.minimum(footprint * t[active], GAP)
        last, way = before[active], moved[active]
        slope = np.where(last > 0, (last - f) / way, 1)
        inside, apart = f < 0, (f >= 0) & (last > 0) & (way > last + f + gap)
        touching = 0.9 * (2 * f / (1 + np.maximum(slope, 0)) + gap)
        ahead = np.maximum(f, np.minimum(touching, f / np.maximum(slope, 0.5)))
        change = np.divide(f, slope, out=np.where(f < NEAR * gap, ahead, f), where=inside)
        change = np.where(apart, last - way, change)
        moved[active] = np.where(inside, way + change, np.where(apart, way, change))
        before[active] = np.where(inside, last, np.where(apart, 0, f))
        t[active] += change
        active = active[t[active] < far[active]]
    return rays
