"""The edges of a triangle mesh, drawn over a picture without those that the mesh itself hides."""

import moderngl

from .camera import Camera
from .compile import compile_program
from .context import Context
from .framebuffer import set_color_mask
from .mesh_program import DEPTH_SHADER, clip_planes, mesh_vertex_shader
from .tiles import Tile
from .triangles import Triangles
from .uniforms import picture_uniforms, tile_uniforms, write_uniform

LINE_SHADER = """#version 330 core
out vec4 color;
void main() { color = vec4(0.05, 0.06, 0.08, 0.6); }
"""
LINE_OFFSET = -1.0, -4.0
"""Factor and units of the polygon offset that moves edges towards the eye, so that their own faces do not hide them."""


class Edges:
    """Draws the edges of one mesh over tiles that a Renderer in the same context has drawn.

    The mesh is in the space of the model that the Renderer draws. Raises ShaderError where the driver refuses a shader.
    """

    def __init__(self, context: Context, mesh: Triangles) -> None:
        self._context = context
        self._reach = mesh.reach
        with context as gl:
            self._programs = [
                compile_program(gl, mesh_vertex_shader(), (text, ()), context.renderer)
                for text in (DEPTH_SHADER, LINE_SHADER)
            ]
            self._vertices, self._indices = gl.buffer(mesh.vertices.tobytes()), gl.buffer(mesh.faces.tobytes())
            self._faces, self._lines = (
                gl.vertex_array(program, [(self._vertices, "3f", "position")], self._indices)
                for program in self._programs
            )

    def prepare(self, size: tuple[int, int], camera: Camera, jitter: tuple[float, float]) -> None:
        """Set the uniforms that `draw` needs; the arguments are those of `Renderer.prepare`."""
        self._write(picture_uniforms(size, camera, jitter))
        self._write({"planes": clip_planes(camera, self._reach)})

    def draw(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int]) -> None:
        """Draw the edges over a tile.

        `Renderer.draw` with the same arguments comes before: it sets the viewport, clears the depth and draws the tile.
        """
        gl = self._context.gl
        self._write(tile_uniforms(tile, corner))
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = "<="
        try:
            set_color_mask(target, (False,) * 4)
            self._faces.render(moderngl.TRIANGLES)
            set_color_mask(target, (True, True, True, False))
            gl.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
            gl.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
            gl.polygon_offset = LINE_OFFSET
            gl.wireframe = True
            self._lines.render(moderngl.TRIANGLES)
        finally:
            gl.wireframe = False
            gl.polygon_offset = 0.0, 0.0
            set_color_mask(target, (True,) * 4)
            gl.depth_func = "<"
            gl.enable_only(moderngl.NOTHING)

    def release(self) -> None:
        """Free the buffers and programs in the context."""
        with self._context:
            for arrays in (self._faces, self._lines):
                arrays.release()
            for buffer in (self._vertices, self._indices):
                buffer.release()
            for program in self._programs:
                program.release()

    def _write(self, values: dict[str, object]) -> None:
        for program in self._programs:
            for name, value in values.items():
                write_uniform(program, name, value)
