"""The shares of the sky and of the key light that points see, step by step as glsl/openness.glsl."""

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .interpret import field

SKY_TAPS, LIGHT_STEPS, SKY_REACH, LIGHT_SIZE, LIFT = 5, 20, 0.7, 0.16, 0.25
ENOUGH, CLEAR, BEHIND, AWAY = 0.85, 0.8, 0.4, 4.0
"""The constants of glsl/openness.glsl."""
BLOCK = 4
"""Pixels along the side of a block in glsl/floor_light.glsl."""
EVALUATIONS = 1 + SKY_TAPS + LIGHT_STEPS
"""Largest number of evaluations of level 1 for a point."""

Values = NDArray[np.float64]


def coarse(program: Program, points: Values) -> Array:
    """Evaluate level 1's field at points (N, 3) anywhere, model space (glsl/coarse.glsl). Returns (N,) float32."""
    far = np.linalg.norm(points, axis=1)
    f = field(program, (points / np.maximum(far, 1)[:, None]).astype(np.float32), 1)
    outside = np.maximum(far - 1, 0)
    return np.asarray(np.where(far > 1, np.hypot(outside, np.maximum(f, 0)), f), np.float32)


def openness(program: Program, points: Values, normals: Values, light: Values, ground: float, floored: bool) -> Values:
    """Estimate how open points are to the sky and to the key light.

    points, normals: (N, 3), model space; light: (3,) of length 1, to the key light; ground: height of the floor.
    floored: whether the points are on the floor. Returns (N, 3): the shares of the sky and of the light, and level 1's
    field.
    """
    count = len(points)
    squared, nearest = (points**2).sum(axis=1), -points @ light
    passed = squared - nearest**2
    shaded = (normals @ light > -LIGHT_SIZE) & (passed < (1 + LIGHT_SIZE * np.maximum(nearest, 0)) ** 2)
    shaded &= (nearest > 0) | (squared < 1)
    here = np.zeros(count) if floored else coarse(program, points).astype(np.float64)
    occluded, weights = np.zeros(count), 0.0
    active: NDArray[np.bool_] = np.ones(count, np.bool_)
    for i in range(SKY_TAPS, 0, -1):
        share = i / SKY_TAPS
        way = SKY_REACH * share * share
        q = points + way * normals
        active &= not floored or np.linalg.norm(q, axis=1) < 1 + way
        under = np.flatnonzero(active)
        q = q[under]
        f = coarse(program, q) - here[under] * max(1 - way / LIFT, 0)
        free = f if floored else np.minimum(f, q[:, 1] - ground)
        occluded[under] += (1 - 0.6 * share) * np.clip(1 - free / way, 0, 1.5)
        weights += 1 - 0.6 * share
        active[under] = not floored or free < ENOUGH * way
    cover = _cover(program, points, light, here, np.flatnonzero(shaded), nearest, passed)
    seen = 0.25 * (1 + cover) ** 2 * (2 - cover)
    return np.stack([np.clip(1 - occluded / weights, 0, 1), seen, here], axis=1)


def _cover(
    program: Program,
    points: Values,
    light: Values,
    here: Values,
    active: NDArray[np.intp],
    nearest: Values,
    passed: Values,
) -> Values:
    """Return the distance of the shape from the rays to the light (N,), in radii of the light, from -1 to 1.

    active: (M,) indices of the points that the shape may shade.
    """
    cover = np.ones(len(points))
    t = np.maximum(0.03, nearest - np.sqrt(np.maximum(1 - passed, 0.1)))
    before = np.tile((0.0, 1.0), (len(points), 1))
    last_but_one = np.tile((-1.0, 1.0), (len(points), 1))
    for _ in range(LIGHT_STEPS):
        q = points[active] + t[active, None] * light
        away = np.linalg.norm(q, axis=1) - 1 >= LIGHT_SIZE * t[active] * cover[active]
        stays = ~(away & (q @ light > 0))
        active, q = active[stays], q[stays]
        f = coarse(program, q) - here[active] * np.maximum(1 - t[active] / LIFT, 0)
        way, ratio = t[active], f / (LIGHT_SIZE * t[active])
        (way_1, ratio_1), (way_0, ratio_0) = before[active].T, last_but_one[active].T
        rise, rise_before = (ratio - ratio_1) / (way - way_1), (ratio_1 - ratio_0) / (way_1 - way_0)
        turns = (way_0 > 0) & (rise_before < 0) & (rise > 0)
        bend = np.where(turns, (rise - rise_before) / (way - way_0), 1)
        at = 0.5 * (way_0 + way_1) - 0.5 * rise_before / bend
        least = np.where(turns, ratio_0 + (at - way_0) * (rise_before + bend * (at - way_1)), ratio)
        cover[active] = np.minimum(cover[active], least)
        last_but_one[active], before[active] = before[active], np.stack([way, ratio], axis=1)
        t[active] += np.maximum(np.abs(f) * np.clip(0.55 + 0.15 * ratio, 0.7, 1), 0.02 + 0.12 * way)
        left = nearest[active] + np.sqrt(np.maximum(1 - passed[active], 0)) - way
        ends = (cover[active] < -1) | (f > CLEAR * (left + LIGHT_SIZE * (way + left)))
        ends |= (ratio > AWAY) & (rise > 0) & (way_1 > 0) & (q @ light > BEHIND)
        active = active[~ends]
    return np.clip(cover, -1, 1)
