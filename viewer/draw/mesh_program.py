"""Shared by the programs of a triangle mesh: vertex shader, depth pass, clip planes."""

import numpy as np

from ... import glsl
from ...codegen.targets.shader import NumberedText
from .camera import Camera

DEPTH_SHADER = "#version 330 core\nvoid main() {}\n"
"""A fragment shader that writes only depth."""
NEAREST = 1e-3
"""Distance of the near plane over that of the far plane, if the eye is inside the mesh."""


def mesh_vertex_shader() -> NumberedText:
    """Return mesh.vert.glsl, the vertex shader of every program that draws the mesh: their depths must agree."""
    text, files = glsl.load_numbered("mesh.vert.glsl")
    return "#version 330 core\n" + text, files


def clip_planes(camera: Camera, reach: float) -> tuple[float, float]:
    """Return the distances of the near and far clip planes along the view axis, model units.

    reach: largest distance of a vertex from the origin, model units.
    """
    back, eye = camera.matrix().T[2:, :3]
    far = 1.01 * (float(np.linalg.norm(eye)) + reach)
    return max(0.99 * (float(eye @ back) - reach), NEAREST * far), far
