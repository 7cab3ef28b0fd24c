"""The shares of the sky and of the key light that points see, step by step as glsl/functions/openness.glsl."""

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .interpret import field

SKY_TAPS, SKY_REACH, LIGHT_SIZE, LIFT, ENOUGH, CLEAR = 5, 0.7, 0.16, 0.25, 0.85, 0.8
PARTS, PART_SIZE, PART_PLACE = 5, 0.55, 0.65
LIGHT_FIRST, LIGHT_STEP, LIGHT_GROWTH, LIGHT_STEPS, LIGHT_STEADY = 0.03, 0.04, 1.14, 16, 0.8
"""The constants of glsl/functions/openness.glsl."""
BLOCK = 4
"""Pixels along the side of a block in glsl/functions/floor_openness.glsl."""
EVALUATIONS = 1 + SKY_TAPS + PARTS * LIGHT_STEPS
"""Largest number of evaluations of level 1 for a point."""

Values = NDArray[np.float64]


def coarse(program: Program, points: Values) -> Array:
    """Evaluate level 1's field at points (N, 3) anywhere, model space (coarse_field.glsl). Returns (N,) float32."""
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
    seen = np.ones(count)
    seen[shaded] = _seen(program, points[shaded], light, here[shaded], PARTS if floored else 1)
    return np.stack([np.clip(1 - occluded / weights, 0, 1), seen, here], axis=1)


def _seen(program: Program, points: Values, light: Values, here: Values, parts: int) -> Values:
    """Return the visible share (N,) of the light, the mean of its `parts` disks. here: level 1 at the points."""
    nearest = -points @ light
    passed = (points**2).sum(axis=1) - nearest**2
    half = np.sqrt(np.maximum(1 - passed, 0.1))
    size = LIGHT_SIZE * (1.0 if parts == 1 else PART_SIZE)
    reach = LIGHT_SIZE * (1.0 if parts == 1 else PART_SIZE + PART_PLACE)
    start, end = _next(np.full(len(points), LIGHT_FIRST), nearest - half), nearest + half
    seen, enter, leave = np.zeros(len(points)), end.copy(), np.zeros(len(points))
    for part in range(parts):
        toward = light + _offset(light, part)
        active = np.arange(len(points)) if part == 0 else np.flatnonzero(leave > 0)
        least, t = np.ones(len(points)), (start if part == 0 else enter).copy()
        cone = reach if part == 0 else size
        t_1, t_0, ratio_1, ratio_0, slope_0 = (np.zeros(len(points)) for _ in range(5))
        for step in range(LIGHT_STEPS):
            q, way = points[active] + t[active, None] * toward, t[active]
            f = coarse(program, q) - here[active] * np.maximum(1 - way / LIFT, 0)
            ratio = f / (size * way)
            found, slope = ratio, np.zeros(len(active))
            if step > 1:
                before, after = way - t_1[active], t_1[active] - t_0[active]
                rise, rise_before = (ratio - ratio_1[active]) / before, (ratio_1 - ratio_0)[active] / after
                slope = (rise * after + rise_before * before) / (before + after)
                dips = (slope_0[active] < 0) & (slope > 0)
                dip = _dip(after, ratio_0[active], ratio_1[active], slope_0[active], slope)
                found = np.where(dips, np.minimum(ratio, dip), ratio)
            least[active] = np.minimum(least[active], found)
            slope_0[active], ratio_0[active], t_0[active] = slope, ratio_1[active], t_1[active]
            ratio_1[active], t_1[active] = ratio, way
            near = f < cone * way
            if part == 0:
                enter[active] = np.where(near, np.minimum(enter[active], way), enter[active])
            t[active] = _next(LIGHT_GROWTH * way + LIGHT_STEP, way + LIGHT_STEADY * (f - cone * way) / (1 + cone))
            if part == 0:
                leave[active] = np.where(near, t[active], leave[active])
            left = np.maximum(end[active] - way, 0)
            ends = (t[active] > (end if part == 0 else leave)[active]) | (f > CLEAR * (left + cone * (way + left)))
            active = active[~(ends | (part > 0) & (least[active] < -1))]
        covered = np.clip(least, -1, 1)
        seen += 0.25 * (1 + covered) ** 2 * (2 - covered) / parts
    return seen


def _offset(light: Values, part: int) -> Values:
    """Return the offset (3,) of the center of one of the light's disks from the light's, at distance 1."""
    if part == 0:
        return np.zeros(3)
    flat = np.hypot(light[0], light[2])
    across = np.array((light[2], 0.0, -light[0])) / flat if flat > 1e-3 else np.array((1.0, 0.0, 0.0))
    turn = 0.25 * np.pi + 0.5 * np.pi * part
    place = np.cos(turn) * across + np.sin(turn) * np.cross(light, across)
    return np.asarray(LIGHT_SIZE * PART_PLACE * place)


def _next(t: Values, goal: Values) -> Values:
    """Return the first of the steps t, LIGHT_GROWTH * t + LIGHT_STEP, ... that is not below the goal."""
    while np.any(below := t < goal):
        t = np.where(below, LIGHT_GROWTH * t + LIGHT_STEP, t)
    return t


def _dip(width: Values, start: Values, end: Values, slope: Values, slope_end: Values) -> Values:
    """Return the least value of a cubic between places `width` apart, with these values, and slopes < 0 and > 0."""
    rise = end - start
    bend = 3 * rise - width * (2 * slope + slope_end)
    twist = width * (slope + slope_end) - 2 * rise
    root = bend + np.sqrt(np.maximum(bend**2 - 3 * twist * width * slope, 0))
    at = np.clip(-width * slope / np.maximum(root, 1e-6), 0, 1)
    return np.asarray(start + at * (width * slope + at * (bend + at * twist)))
