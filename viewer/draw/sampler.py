"""Draws one sample of each pixel with a baked shader."""

import time
from collections.abc import Iterable

import moderngl
import numpy as np

from ...codegen.targets.shader import FRAME, Shader
from ...codegen.targets.uniforms import SCHEDULES, SHADINGS
from ...model.errors import UserError
from .camera import Camera
from .compile import VERTEX_SHADER, cell_texture, weight_texture
from .context import Context
from .edges import Edges
from .framebuffer import check_drawn, free, new_framebuffer
from .loop_limit import schedule_that_fits
from .options import RenderOptions
from .passes import Passes
from .program import UNITS, Program, picture_uniforms, tile_uniforms, write_all
from .tiles import Tile

_WITHOUT_COLOR = tuple(dict.fromkeys(FRAME[step] for step in FRAME if step not in ("floor", "color")))
"""The passes of every shading."""


class Sampler:
    """The programs, textures and framebuffers of one shader in a context.

    Draws the shader's passes if it has some. Raises UserError if the driver rejects the shader or the weights.
    """

    context: Context
    shader: Shader
    edges: Edges | None = None
    """Edges of a mesh, drawn over every picture but raw data."""
    compile_seconds = 0.0
    """Seconds to compile, link and draw one pixel: drivers do most of their compiling at the first draw."""

    def __init__(self, context: Context, shader: Shader, shading: str = "phong") -> None:
        """Compile the programs of the `shading`; `prepare` compiles what another shading needs."""
        self.context = context
        self.shader = shader
        self._draws_edges = False
        self._framebuffer: moderngl.Framebuffer | None = None
        self._passes: Passes | None = None
        self._weights: moderngl.Texture | None = None
        self._cells: moderngl.Texture3D | None = None
        self._cells_time = 0.0
        """Time of the grid in `_cells`."""
        self._programs: dict[str, Program] = {}
        start = time.perf_counter()
        with context as gl:
            try:
                self._compile(("main",) if shader.passes is None else (*_WITHOUT_COLOR, *_color_passes(shading)))
                if shader.weights is not None:
                    self._weights = weight_texture(gl, shader.weights)
                if shader.cells is not None:
                    self._cells = cell_texture(gl, shader.cells.grid())
                if shader.passes is not None:
                    self._passes = Passes(gl, self._programs, packs=context.software)
                    self._passes.color = _color_passes(shading)[-1]
                self.draw(self._target(gl, (1, 1)), (0, 0, 1, 1))
                check_drawn(gl, context.renderer)
            except UserError:
                self.release()
                raise
        self.compile_seconds = time.perf_counter() - start

    def schedule(self, options: RenderOptions) -> tuple[tuple[int, ...], int]:
        """Return the iterations of each level, and the rounds, within software GL's loop limit.

        Raises UserError if not even one round fits.
        """
        iterations, rounds = options.resolved_iterations(self.shader.iterations), self.wanted_rounds(options)
        if not self.context.software:
            return iterations, rounds
        level, normal_level = options.resolved_levels(self.shader.levels)
        shaded = max(level, normal_level) if options.split_at else normal_level
        return schedule_that_fits(self.shader, level, shaded, iterations, rounds, options.schedule)

    def wanted_rounds(self, options: RenderOptions) -> int:
        """Return the rounds of the options, or the shader's default."""
        default = self._default("rounds")
        return options.rounds or (int(np.frombuffer(default, np.int32)[0]) if default else 1)

    def default(self, name: str) -> tuple[float, ...]:
        """Return the default of a float uniform; () if no program uses it."""
        return tuple(np.frombuffer(self._default(name), np.float32).tolist())

    def prepare(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, jitter: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Set the uniforms for `draw`; the context must be current.

        size: (width, height) of the picture, pixels. jitter: offset of the sample from the pixel's center, pixels.
        """
        if (passes := self._passes) is not None:
            names, passes.jitter = _color_passes(options.shade), jitter
            self._compile(names)
            passes.color = names[-1]
            passes.level, normal_level = options.resolved_levels(self.shader.levels)
            passes.newton_first = passes.level == normal_level and options.schedule == "relaxed"
            passes.newton_first &= self.shader.newton_first and self._uses_cells(options)
        for program in self._programs.values():
            program.reset()
        self._load_cells(options.time)
        write_all(self._programs, self._option_uniforms(options) | picture_uniforms(size, camera, jitter))
        self._draws_edges = options.shade != "data"
        if self.edges is not None:
            self.edges.prepare(size, camera, jitter)

    def draw(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int] = (0, 0)) -> None:
        """Draw one sample of a tile's pixels, after `prepare` in the same `with context:`.

        target: RGBA32F with a depth buffer. corner: the target's pixel for the tile's lower left corner.
        """
        target.use()
        target.viewport = (*corner, *tile[2:])
        target.clear(viewport=target.viewport)
        self._draw_surface(target, tile, corner)
        if self.edges is not None and self._draws_edges:
            self.edges.draw(target, tile, corner)

    def release(self) -> None:
        with self.context:
            if self._framebuffer is not None:
                free(self._framebuffer)
            for resource in (self._weights, self._cells, self._passes, *self._programs.values()):
                if resource is not None:
                    resource.release()

    def _compile(self, names: Iterable[str]) -> None:
        """Compile the programs of passes, or "main" of a shader without passes, unless they are. Raises ShaderError."""
        for name in names:
            if name not in self._programs:
                start, passes = time.perf_counter(), self.shader.passes
                text = (self.shader.text, self.shader.files) if passes is None else passes[name]
                self._programs[name] = Program(self.context.gl, (VERTEX_SHADER, ()), text, self.context.renderer)
                self.compile_seconds += time.perf_counter() - start

    def _default(self, name: str) -> bytes:
        """Return the default of a uniform; b"" if no program uses it."""
        return next((program.defaults[name] for program in self._programs.values() if name in program.defaults), b"")

    def _target(self, gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
        """Return the framebuffer for tiles, `size` (width, height)."""
        # One format for every draw: software GL compiles the shader again for another one.
        if self._framebuffer is None or self._framebuffer.size != size:
            if self._framebuffer is not None:
                free(self._framebuffer)
            self._framebuffer = new_framebuffer(gl, size)
        return self._framebuffer

    def _option_uniforms(self, options: RenderOptions) -> dict[str, object]:
        """Return the uniforms, name -> value, that the options set."""
        level, normal_level = options.resolved_levels(self.shader.levels)
        iterations, rounds = self.schedule(options)
        top, bottom = options.colors or (None, None)
        values: dict[str, object] = {
            "level": level,
            "normal_level": normal_level,
            "iterations": iterations,
            "rounds": rounds,
            "delta": tuple(delta * options.delta_scale for delta in self.shader.deltas),
            "step_scale": options.step_scale,
            "schedule": SCHEDULES.index(options.schedule),
            "shading": SHADINGS.index(options.shade),
            "plain": options.plain,
            "split": options.split_at,
            "time": options.time,
            "light": options.light,
            "background_top": top,
            "background_bottom": bottom,
        }
        if self.shader.cells is not None:
            count = self.shader.cells.count if self._uses_cells(options) else 0
            values |= {"cell_count": count, "cells_half": self.shader.cells.half}
        return {name: value for name, value in values.items() if value is not None}

    def _uses_cells(self, options: RenderOptions) -> bool:
        """Whether the grid of cells is valid: it holds for the last level, unscaled bands, and certain times."""
        level, _ = options.resolved_levels(self.shader.levels)
        cells, whole = self.shader.cells, level == self.shader.levels and options.delta_scale == 1.0
        return cells is not None and whole and cells.holds(options.time)

    def _load_cells(self, time: float) -> None:
        """Upload the grid of cells of a time, unless it is already in the texture."""
        cells = self.shader.cells
        if cells is None or self._cells is None or cells.moments == 1 or not cells.holds(time):
            return
        if time != self._cells_time:
            self._cells.write(cells.grid(time).tobytes(), alignment=1)
            self._cells_time = time

    def _draw_surface(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int]) -> None:
        """Draw a tile without edges into the `target`, which is bound and cleared."""
        if self._weights is not None:
            self._weights.use(UNITS["weights"])
        if self._cells is not None:
            self._cells.use(UNITS["cells"])
        write_all(self._programs, tile_uniforms(tile, corner))
        if self._passes is not None:
            self._passes.draw(target, tile, corner)
        else:
            self._programs["main"].draw(3)


def _color_passes(shading: str) -> tuple[str, ...]:
    """Return the names of the passes that color the pixels."""
    return ("floor", "softbox") if shading == "softbox" else ("color",)
