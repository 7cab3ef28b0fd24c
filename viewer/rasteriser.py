"""Draws a triangle mesh that wears the normals of a baked field (Section 3.2, Appendix D; Fig. 7, middle)."""

from dataclasses import replace

import moderngl
import numpy as np

import glsl
from codegen.glsl330 import bake
from codegen.model import Model

from .camera import Camera
from .context import Context
from .mesh_file import Triangles
from .options import RenderOptions
from .renderer import Renderer

NEAREST = 1e-3
"""Of the distance of the far plane: the near one, where the eye is inside the mesh."""


class Rasteriser(Renderer):
    """`Renderer` with a mesh in place of the ray: OpenGL's triangles, a depth buffer, glsl/mesh.glsl.

    No ray is traced: `level`, `iterations`, `rounds`, `delta_scale` and `step_scale` of the options have no effect.
    Raises what `Renderer` and `bake` raise.
    """

    vertex_shader = glsl.load("mesh.vert.glsl")

    def __init__(self, context: Context, model: Model, mesh: Triangles, storage: str = "auto") -> None:
        self._mesh, self._reach = mesh, float(np.linalg.norm(mesh.vertices[mesh.faces], axis=-1).max())
        self._buffers: list[moderngl.Buffer] = []
        self._backdrop = Renderer(context, bake(model, storage, main="backdrop.glsl"))
        super().__init__(context, bake(model, storage, main="mesh.glsl"))
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
            for buffer in self._buffers:
                buffer.release()

    def _vertex_array(self, gl: moderngl.Context) -> moderngl.VertexArray:
        vertices = np.concatenate([self._mesh.vertices, self._mesh.normals], axis=1)
        corners, faces = gl.buffer(vertices.tobytes()), gl.buffer(self._mesh.faces.tobytes())
        self._buffers = [corners, faces]
        return gl.vertex_array(self._program, [(corners, "3f 3f", "position", "normal")], faces)

    def _depth(self, gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Renderbuffer | None:
        return gl.depth_renderbuffer(size)

    def _set(self, name: str, value: object) -> None:
        super()._set(name, value)
        self._backdrop._set(name, value)

    def _set_options(self, options: RenderOptions) -> None:
        self._backdrop._set_options(replace(options, level=1, normal_level=1, iterations=(1,), rounds=1))
        super()._set_options(options)

    def _set_camera(self, size: tuple[int, int], camera: Camera) -> None:
        super()._set_camera(size, camera)
        away = float(np.linalg.norm(camera.matrix()[:3, 3]))
        far = 1.01 * (away + self._reach)
        self._set("planes", (max(0.99 * (away - self._reach), NEAREST * far), far))

    def _draw(self, target: moderngl.Framebuffer, size: tuple[int, int], origin: tuple[int, int]) -> None:
        gl = self.context.gl
        target.clear()
        self._backdrop._draw(target, size, origin)
        if self._weights is not None:
            self._weights.use(0)
        self._set("origin", (float(origin[0]), float(origin[1])))
        self._set("tile", (float(size[0]), float(size[1])))
        gl.enable_only(moderngl.DEPTH_TEST)
        try:
            gl.depth_func = "<"
            # Depth first, so that the network runs once a pixel, whatever the order of the triangles.
            target.color_mask = (False,) * 4
            self._vertices.render(moderngl.TRIANGLES)
            target.color_mask = (True,) * 4
            gl.depth_func = "<="
            self._vertices.render(moderngl.TRIANGLES)
        finally:
            target.color_mask = (True,) * 4
            gl.enable_only(moderngl.NOTHING)
