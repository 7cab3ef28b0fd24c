"""What the programs that draw a triangle mesh have in common: the vertex shader, the depth pass, the clip planes."""

import numpy as np

from ... import glsl
from ...codegen.targets.shader import NumberedText
from .camera import Camera

DEPTH_SHADER = """#version 330 core
void main() {}
"""
"""The fragment shader of a program that writes depth and no colour."""
NEAREST = 1e-3
"""Distance of the near plane as a share of the far plane's, where the eye is inside the mesh."""


def mesh_vertex_shader() -> NumberedText:
    """Return the vertex shader glsl/mesh.vert.glsl; every program that draws the mesh has it, so that depths agree."""
    text, files = glsl.load_numbered("mesh.vert.glsl")
    return "#version 330 core\n" + text, files


def clip_planes(camera: Camera, reach: float) -> tuple[float, float]:
    """Return the distances of the near and the far clip plane along the view, in model units.

    reach: largest distance of a vertex of the mesh from the origin, in model units.
    """
    back, eye = camera.matrix().T[2:, :3]
    far = 1.01 * (float(np.linalg.norm(eye)) + reach)
    return max(0.99 * (float(eye @ back) - reach), NEAREST * far), far
