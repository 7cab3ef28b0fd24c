"""Draws a triangle mesh that wears the normals of a baked field (Section 3.2, Appendix D; Fig. 7, middle)."""

from dataclasses import replace

import moderngl
import numpy as np

from ...model.errors import UserError
from ...model.model import Model
from .camera import Camera
from .compile import bake_numbered
from .context import Context
from .framebuffer import set_color_mask
from .mesh_program import DEPTH_SHADER, clip_planes, mesh_vertex_shader
from .options import RenderOptions
from .program import UNITS, Program
from .renderer import Renderer
from .sampler import Sampler
from .tiles import Tile
from .triangles import Triangles
from .uniforms import tile_uniforms


class Rasteriser(Renderer):
    """A Renderer that draws a mesh in place of rays: OpenGL's triangles, a depth buffer, glsl/mesh.glsl.

    No ray is traced: the options `level`, `iterations`, `rounds`, `delta_scale` and `step_scale` have no effect.
    Raises what `Renderer` and `bake` raise.
    """

    def __init__(self, context: Context, model: Model, mesh: Triangles, storage: str = "auto") -> None:
        self._mesh = mesh
        self.vertex_shader = mesh_vertex_shader()
        self._buffers: list[moderngl.Buffer] = []
        self._backdrop = Sampler(context, bake_numbered(model, storage, "backdrop.glsl"))
        try:
            super().__init__(context, bake_numbered(model, storage, "mesh.glsl"))
        except UserError:
            self._backdrop.release()
            raise
        self.compile_seconds += self._backdrop.compile_seconds

    def schedule(self, options: RenderOptions) -> tuple[tuple[int, ...], int]:
        """Return the schedule of a ray of one step, which costs more than none.

        Raises UserError where software GL cannot run even that.
        """
        _, normal_level = options.resolved_levels(self.shader.levels)
        return super().schedule(replace(options, level=1, normal_level=normal_level, iterations=(1,), rounds=1))

    def prepare(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, jitter: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Set the uniforms for `draw`, as `Renderer.prepare` does, and the clip planes of the mesh."""
        super().prepare(size, camera, options, jitter)
        self._write({"planes": clip_planes(camera, self._mesh.reach)})

    def release(self) -> None:
        """Free everything that is held in the context."""
        self._backdrop.release()
        super().release()
        with self.context:
            for buffer in self._buffers:
                buffer.release()

    def _take_vertices(self, gl: moderngl.Context) -> None:
        vertices = np.concatenate([self._mesh.vertices, self._mesh.normals], axis=1)
        corners, faces = gl.buffer(vertices.tobytes()), gl.buffer(self._mesh.faces.tobytes())
        # A program of its own: software GL would compile the network again for a draw without colours.
        depth = Program(gl, self.vertex_shader, (DEPTH_SHADER, ()), self.context.renderer)
        depth.take([(corners, "3f 12x", "position")], faces)
        self._programs["main"].take([(corners, "3f 3f", "position", "normal")], faces)
        self._programs["depth"] = depth
        self._buffers = [corners, faces]

    def _reset_uniforms(self) -> None:
        super()._reset_uniforms()
        self._backdrop._reset_uniforms()

    def _write(self, values: dict[str, object]) -> None:
        super()._write(values)
        self._backdrop._write(values)

    def _draw_surface(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int]) -> None:
        gl = self.context.gl
        self._backdrop._draw_surface(target, tile, corner)
        if self._weights is not None:
            self._weights.use(UNITS["weights"])
        self._write(tile_uniforms(tile, corner))
        gl.enable_only(moderngl.DEPTH_TEST)
        try:
            gl.depth_func = "<"
            # Depth first, so that the network runs once a pixel, whatever the order of the triangles.
            set_color_mask(target, (False,) * 4)
            self._programs["depth"].draw()
            set_color_mask(target, (True,) * 4)
            gl.depth_func = "<="
            self._programs["main"].draw()
        finally:
            gl.depth_func = "<"
            set_color_mask(target, (True,) * 4)
            gl.enable_only(moderngl.NOTHING)
