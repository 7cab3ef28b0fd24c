"""Draws a triangle mesh that wears the normals of a baked field (Section 3.2, Appendix D; Fig. 7, middle)."""

from dataclasses import replace

import moderngl
import numpy as np

from ...model.errors import UserError
from ...model.model import Model
from .camera import Camera
from .compile import baked
from .context import Context
from .edges import DEPTH_SHADER, planes, vertex_shader
from .framebuffer import set_color_mask
from .options import RenderOptions
from .renderer import Part, Renderer
from .triangles import Triangles


class Rasteriser(Renderer):
    """`Renderer` with a mesh in place of the ray: OpenGL's triangles, a depth buffer, glsl/mesh.glsl.

    No ray is traced: `level`, `iterations`, `rounds`, `delta_scale` and `step_scale` of the options have no effect.
    Raises what `Renderer` and `bake` raise.
    """

    def __init__(self, context: Context, model: Model, mesh: Triangles, storage: str = "auto") -> None:
        self._mesh, self.vertex_shader = mesh, vertex_shader()
        self._freed: list[moderngl.Buffer | moderngl.VertexArray | moderngl.Program] = []
        self._backdrop = Renderer(context, baked(model, storage, "backdrop.glsl"))
        try:
            super().__init__(context, baked(model, storage, "mesh.glsl"))
        except UserError:
            self._backdrop.release()
            raise
        self.compile_seconds += self._backdrop.compile_seconds

    def schedule(self, options: RenderOptions) -> tuple[tuple[int, ...], int]:
        """Of a ray of one step, which costs more than none. Raises UserError where software GL cannot run even that."""
        _, normal_level = options.traced(self.shader.levels)
        return super().schedule(replace(options, level=1, normal_level=normal_level, iterations=(1,), rounds=1))

    def release(self) -> None:
        """Frees what is held in the context."""
        self._backdrop.release()
        super().release()
        with self.context:
            for held in self._freed:
                held.release()

    def _vertex_array(self, gl: moderngl.Context) -> moderngl.VertexArray:
        vertices = np.concatenate([self._mesh.vertices, self._mesh.normals], axis=1)
        corners, faces = gl.buffer(vertices.tobytes()), gl.buffer(self._mesh.faces.tobytes())
        # A program of its own: software GL would compile the network again for a draw without colours.
        depth = gl.program(vertex_shader=self.vertex_shader[0], fragment_shader=DEPTH_SHADER)
        self._depths = gl.vertex_array(depth, [(corners, "3f 12x", "position")], faces)
        self._freed = [self._depths, depth, corners, faces]
        return gl.vertex_array(self._program, [(corners, "3f 3f", "position", "normal")], faces)

    def _set(self, name: str, value: object) -> None:
        super()._set(name, value)
        self._backdrop._set(name, value)
        depth = self._depths.program
        if name in depth:
            uniform = depth[name]
            assert isinstance(uniform, moderngl.Uniform)
            uniform.write(np.ascontiguousarray(value, np.float32).tobytes())

    def _set_options(self, options: RenderOptions) -> None:
        self._backdrop._set_options(replace(options, level=1, normal_level=1, iterations=(1,), rounds=1))
        super()._set_options(options)

    def prepare(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, jitter: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """As `Renderer.prepare`."""
        super().prepare(size, camera, options, jitter)
        self._set("planes", planes(camera, self._mesh.reach))

    def _draw(self, target: moderngl.Framebuffer, part: Part, at: tuple[int, int]) -> None:
        gl = self.context.gl
        self._backdrop._draw(target, part, at)
        if self._weights is not None:
            self._weights.use(0)
        self._set("origin", (float(part[0] - at[0]), float(part[1] - at[1])))
        self._set("viewport", (float(at[0]), float(at[1]), float(part[2]), float(part[3])))
        gl.enable_only(moderngl.DEPTH_TEST)
        try:
            gl.depth_func = "<"
            # Depth first, so that the network runs once a pixel, whatever the order of the triangles.
            set_color_mask(target, (False,) * 4)
            self._depths.render(moderngl.TRIANGLES)
            set_color_mask(target, (True,) * 4)
            gl.depth_func = "<="
            self._vertices.render(moderngl.TRIANGLES)
        finally:
            gl.depth_func = "<"
            set_color_mask(target, (True,) * 4)
            gl.enable_only(moderngl.NOTHING)
