"""A model as dense marching sees it, which pictures by sphere tracing are compared with. Imported by other scripts."""

import numpy as np
from numpy.typing import NDArray

from mplicits.codegen.ir.program import Program
from mplicits.codegen.reference.dense import dense_march
from mplicits.viewer.draw.camera import Camera

STOP = 0.05
"""Pixels: a ray that passes the surface closer than this may count as a hit or not (glsl/march.glsl)."""


def closest_approach(program: Program, camera: Camera, side: int) -> NDArray[np.float32]:
    """Return how close each ray of a picture of side x side pixels comes to the last level's surface.

    The result is (side, side), top row first, in pixels: 0 where the ray meets the surface.
    """
    eye, directions, footprint = camera.rays(side, side)
    closest, _ = dense_march(program, eye, directions.reshape(-1, 3), len(program.bands), footprint)
    return closest.reshape(side, side)
