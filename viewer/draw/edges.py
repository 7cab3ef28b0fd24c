"""The visible edges of a triangle mesh, drawn over a picture."""

import moderngl

from .camera import Camera
from .context import Context
from .framebuffer import set_color_mask
from .mesh_program import DEPTH_SHADER, clip_planes, mesh_vertex_shader
from .program import Program, picture_uniforms, tile_uniforms
from .tiles import Tile
from .triangles import Triangles

LINE_SHADER = """#version 330 core
out vec4 color;
void main() { color = vec4(0.05, 0.06, 0.08, 0.6); }
"""
LINE_OFFSET = -1.0, -4.0
"""Factor and units of the polygon offset that moves edges in front of their own faces."""


class Edges:
    """Draws the edges of a mesh over the tiles of a Renderer in the same context and space.

    Raises ShaderError if the driver rejects a shader.
    """

    def __init__(self, context: Context, mesh: Triangles) -> None:
        self._context = context
        self._reach = mesh.reach
        with context as gl:
            self._buffers = gl.buffer(mesh.vertices.tobytes()), gl.buffer(mesh.faces.tobytes())
            content = [(self._buffers[0], "3f", "position")]
            self._depth, self._lines = (
                Program(gl, mesh_vertex_shader(), (text, ()), context.renderer, content, self._buffers[1])
                for text in (DEPTH_SHADER, LINE_SHADER)
            )

    def prepare(self, size: tuple[int, int], camera: Camera, jitter: tuple[float, float]) -> None:
        """Set the uniforms for `draw`; the arguments are those of `Renderer.prepare`."""
        planes: dict[str, object] = {"planes": clip_planes(camera, self._reach)}
        for program in (self._depth, self._lines):
            program.write(picture_uniforms(size, camera, jitter) | planes)

    def draw(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int]) -> None:
        """Draw the edges over a tile, after `Renderer.draw` with the same arguments, which clears the depth."""
        gl = self._context.gl
        for program in (self._depth, self._lines):
            program.write(tile_uniforms(tile, corner))
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = "<="
        try:
            set_color_mask(target, (False,) * 4)
            self._depth.draw()
            set_color_mask(target, (True, True, True, False))
            gl.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
            gl.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
            gl.polygon_offset = LINE_OFFSET
            gl.wireframe = True
            self._lines.draw()
        finally:
            gl.wireframe = False
            gl.polygon_offset = 0.0, 0.0
            set_color_mask(target, (True,) * 4)
            gl.depth_func = "<"
            gl.enable_only(moderngl.NOTHING)

    def release(self) -> None:
        with self._context:
            for resource in (self._depth, self._lines, *self._buffers):
                resource.release()
