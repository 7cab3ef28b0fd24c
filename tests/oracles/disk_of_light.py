"""The visible share of the studio's key light by many traced rays, and lines across a shadow's edge."""

import numpy as np
from numpy.typing import NDArray

from mplicits.field.openness import LIGHT_SIZE, coarse
from mplicits.ir.program import Program

Values = NDArray[np.float64]

RAYS = 256
"""Samples of the light."""
FINEST = 0.01
"""Shortest step, model units."""
CAREFUL = 0.7
"""Factor on steps, since the field may exceed the distance."""


def visible_share(program: Program, points: Values, light: Values) -> Values:
    """Trace rays from points (N, 3) to a disk of light, through level 1's field. Returns (N,).

    light: (3,) of length 1, to the center of the disk, whose radius is LIGHT_SIZE at distance 1.
    """
    across = np.cross(light, (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    number = np.arange(RAYS)
    place, turn = LIGHT_SIZE * np.sqrt((number + 0.5) / RAYS), number * np.pi * (3 - np.sqrt(5))  # Vogel's spiral
    toward = light + (place * np.cos(turn))[:, None] * across
    toward += (place * np.sin(turn))[:, None] * np.cross(across, light)
    ways = np.tile(toward / np.linalg.norm(toward, axis=1)[:, None], (len(points), 1))
    starts = np.repeat(points, RAYS, axis=0)
    nearest = -(starts * ways).sum(axis=1)
    chord = 1 - ((starts**2).sum(axis=1) - nearest**2)
    end = nearest + np.sqrt(np.maximum(chord, 0))
    t = np.maximum(nearest - np.sqrt(np.maximum(chord, 0)), FINEST)
    hidden = np.zeros(len(starts), bool)
    active = np.flatnonzero((chord > 0) & (end > 0))
    while len(active):
        f = coarse(program, starts[active] + t[active, None] * ways[active])
        hidden[active] = f < 0
        t[active] += np.maximum(CAREFUL * f, FINEST)
        active = active[(f >= 0) & (t[active] < end[active])]
    return np.asarray(1 - hidden.reshape(len(points), RAYS).mean(axis=1))


def lines_across(light: Values, ground: float, count: int, points: int, length: float = 1.8) -> Values:
    """Return lines of points on the floor (count, points, 3) that leave the middle of the shadow in all directions."""
    middle = -ground / light[1] * -light
    turns = 2 * np.pi * (np.arange(count) + 0.5) / count
    way = np.stack([np.cos(turns), np.zeros(count), np.sin(turns)], axis=1)
    line = middle + np.linspace(0, length, points)[:, None] * way[:, None]
    line[..., 1] = ground
    return np.asarray(line)


def falls(line: Values) -> Values:
    """Return by how much each line (count, points) falls below an earlier value, (count,)."""
    return np.asarray((np.maximum.accumulate(line, axis=1) - line).max(axis=1))
