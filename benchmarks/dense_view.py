"""Dense marching of a model, the truth for pictures by sphere tracing. Imported by other scripts."""

import numpy as np
from numpy.typing import NDArray

from mplicits.field.interpret import nested_field
from mplicits.ir.program import Program
from mplicits.viewer.draw.camera import Camera

STOP = 0.05
"""Pixels: a ray that passes the surface closer than this may count as a hit or not (glsl/functions/march.glsl)."""

STRETCH = 32
"""Points of a stretch of a ray that are evaluated."""

ELEVATIONS = (20, -25, 50, 0)
"""Of the views around a model, in turn, degrees."""

Picture = NDArray[np.float32]
"""(side, side, 4): distance along the ray, steps, level, and whether the ray hit."""


def views(count: int) -> list[Camera]:
    """Return cameras around a model, at different heights."""
    return [Camera(azimuth=30 + 360 * i / count, elevation=ELEVATIONS[i % 4]) for i in range(count)]


def lost_and_extra(
    rays: NDArray[np.float32], closest: NDArray[np.float32], farthest: NDArray[np.floating], stop: float = STOP
) -> tuple[int, int]:
    """Count lost rays, and extra rays: hits of tracing that pass the surface at over `stop` pixels.

    rays: (N, 4), of a Picture. closest: (N,) pixels, of dense marching. farthest: (N,) distance along the ray; a hit
    beyond it is on another part of the shape.
    """
    hit = rays[:, 3] > 0.5
    lost = (closest == 0) & (~hit | (rays[:, 0] > farthest))
    return int(lost.sum()), int(((closest > stop) & hit).sum())


def along_surface(
    program: Program,
    eye: NDArray[np.float64],
    directions: NDArray[np.float64],
    ends: tuple[NDArray[np.floating], NDArray[np.floating]],
    footprint: float,
) -> NDArray[np.bool_]:
    """Tell which rays are within STOP pixels of the last level's surface all the way between two distances.

    eye: (3,); directions: (N, 3) of length 1, model space. ends: both distances, (N,) each. footprint: width of a pixel
    at distance 1. A ray that grazes the surface may rightly end anywhere on such a stretch. Returns (N,).
    """
    t = np.linspace(*ends, STRETCH, axis=1)
    points = (eye + t[..., None] * directions[:, None]).reshape(-1, 3).astype(np.float32)
    value, reached = nested_field(program, points, len(program.bands))
    near = (reached == len(program.bands)) & (np.abs(value) <= STOP * footprint * t.ravel())
    return np.asarray(near.reshape(t.shape).all(axis=1))
