"""Draws a triangle mesh with the normals of a baked field (Section 3.2, Appendix D; Fig. 7, middle)."""

from collections.abc import Iterable

import moderngl
import numpy as np

from ...model.model import Model
from .camera import Camera
from .compile import VERTEX_SHADER, bake_numbered
from .context import Context
from .framebuffer import set_color_mask
from .loop_limit import schedule_that_fits
from .mesh_program import DEPTH_SHADER, clip_planes, mesh_vertex_shader
from .options import RenderOptions
from .program import UNITS, Program, tile_uniforms, write_all
from .renderer import Renderer
from .tiles import Tile
from .triangles import Triangles


class Rasterizer(Renderer):
    """A Renderer that rasterizes a mesh instead of tracing rays (glsl/passes/mesh.glsl).

    The options `level`, `iterations`, `rounds`, `delta_scale` and `step_scale` have no effect. Raises UserError as
    `Renderer` and `bake` do.
    """

    def __init__(self, context: Context, model: Model, mesh: Triangles, storage: str = "auto") -> None:
        self._mesh = mesh
        self._buffers: tuple[moderngl.Buffer, ...] = ()
        self._backdrop = bake_numbered(model, storage, "mesh_background.glsl")
        super().__init__(context, bake_numbered(model, storage, "mesh.glsl"))

    def schedule(self, options: RenderOptions) -> tuple[tuple[int, ...], int]:
        """Return the schedule of a single step: no ray is traced. Raises UserError as `Renderer.schedule` does."""
        _, normal_level = options.resolved_levels(self.shader.levels)
        iterations = (1,) * self.shader.levels
        if not self.context.software:
            return iterations, 1
        return schedule_that_fits(self.shader, 1, normal_level, iterations, 1, options.schedule)

    def prepare(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, jitter: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Set the uniforms for `draw`, as `Renderer.prepare` does, and the clip planes of the mesh."""
        super().prepare(size, camera, options, jitter)
        write_all(self._programs, {"planes": clip_planes(camera, self._mesh.reach)})

    def release(self) -> None:
        super().release()
        with self.context:
            for buffer in self._buffers:
                buffer.release()

    def _compile(self, names: Iterable[str]) -> None:
        gl, driver = self.context.gl, self.context.renderer
        vertices = np.concatenate([self._mesh.vertices, self._mesh.normals], axis=1)
        corners, faces = self._buffers = gl.buffer(vertices.tobytes()), gl.buffer(self._mesh.faces.tobytes())
        # Depth has a separate program: software GL would compile the network again for a draw without colors.
        for name, text, content in (
            ("main", (self.shader.text, self.shader.files), (corners, "3f 3f", "position", "normal")),
            ("depth", (DEPTH_SHADER, ()), (corners, "3f 12x", "position")),
        ):
            self._programs[name] = Program(gl, mesh_vertex_shader(), text, driver, [content], faces)
        backdrop = (self._backdrop.text, self._backdrop.files)
        self._programs["backdrop"] = Program(gl, (VERTEX_SHADER, ()), backdrop, driver)

    def _draw_surface(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int]) -> None:
        gl = self.context.gl
        if self._weights is not None:  # the backdrop's weights are the same
            self._weights.use(UNITS["weights"])
        write_all(self._programs, tile_uniforms(tile, corner))
        self._programs["backdrop"].draw(3)
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
