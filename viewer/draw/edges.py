"""The edges of a triangle mesh, drawn over a picture; hidden ones are left out."""

import moderngl
import numpy as np

from ... import glsl
from .camera import Camera
from .compile import Numbered, compiled
from .context import Context
from .framebuffer import set_color_mask
from .triangles import Triangles

DEPTH_SHADER = """#version 330 core
void main() {}
"""
LINE_SHADER = """#version 330 core
out vec4 color;
void main() { color = vec4(0.05, 0.06, 0.08, 0.6); }
"""
NEAREST = 1e-3
"""Of the distance of the far plane: the near one, where the eye is inside the mesh."""
NEARER = -1.0, -4.0
"""Factor and units by which edges are moved towards the eye, so that their own faces do not hide them."""


def vertex_shader() -> Numbered:
    """Of every program that draws a mesh."""
    text, files = glsl.load_numbered("mesh.vert.glsl")
    return "#version 330 core\n" + text, files


def planes(camera: Camera, reach: float) -> tuple[float, float]:
    """Of near and far along the view, for a mesh whose vertices are at most `reach` from the origin."""
    back, eye = camera.matrix().T[2:, :3]
    far = 1.01 * (float(np.linalg.norm(eye)) + reach)
    return max(0.99 * (float(eye @ back) - reach), NEAREST * far), far


class Edges:
    """In `context`, for any picture of the model that the mesh belongs to. Raises ShaderError."""

    def __init__(self, context: Context, mesh: Triangles) -> None:
        self._context = context
        self._reach = mesh.reach
        with context as gl:
            self._programs = [
                compiled(gl, vertex_shader(), (text, ()), context.renderer) for text in (DEPTH_SHADER, LINE_SHADER)
            ]
            self._buffers = gl.buffer(mesh.vertices.tobytes()), gl.buffer(mesh.faces.tobytes())
            corners, faces = self._buffers
            self._faces, self._lines = (
                gl.vertex_array(program, [(corners, "3f", "position")], faces) for program in self._programs
            )

    def prepare(self, size: tuple[int, int], camera: Camera, jitter: tuple[float, float]) -> None:
        """Sets what `draw` needs, as `Renderer.prepare` does."""
        self._set("resolution", (float(size[0]), float(size[1])))
        self._set("camera", tuple(camera.matrix().T.ravel().tolist()))
        self._set("focal", camera.focal)
        self._set("jitter", jitter)
        self._set("planes", planes(camera, self._reach))

    def draw(self, target: moderngl.Framebuffer, part: tuple[int, int, int, int], at: tuple[int, int]) -> None:
        """Over what the part shows: as `Renderer.draw`, which has set the viewport and cleared the depth."""
        gl = self._context.gl
        self._set("viewport", (float(at[0]), float(at[1]), float(part[2]), float(part[3])))
        self._set("origin", (float(part[0] - at[0]), float(part[1] - at[1])))
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = "<="
        try:
            set_color_mask(target, (False,) * 4)
            self._faces.render(moderngl.TRIANGLES)
            set_color_mask(target, (True, True, True, False))
            gl.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
            gl.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
            gl.polygon_offset = NEARER
            gl.wireframe = True
            self._lines.render(moderngl.TRIANGLES)
        finally:
            gl.wireframe = False
            gl.polygon_offset = 0.0, 0.0
            set_color_mask(target, (True,) * 4)
            gl.depth_func = "<"
            gl.enable_only(moderngl.NOTHING)

    def release(self) -> None:
        """Frees what is held in the context."""
        with self._context:
            for arrays in (self._faces, self._lines):
                arrays.release()
            for buffer in self._buffers:
                buffer.release()
            for program in self._programs:
                program.release()

    def _set(self, name: str, value: object) -> None:
        for program in self._programs:
            program[name] = value
