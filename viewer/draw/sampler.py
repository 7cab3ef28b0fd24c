"""Draws one sample of a picture's pixels with a baked shader, refusing what the driver would draw wrong."""

import time

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.shader import PASSES, NumberedText, Shader
from ...codegen.targets.uniforms import SCHEDULES, SHADINGS
from ...model.errors import UserError
from .camera import Camera
from .compile import VERTEX_SHADER, cell_texture, weight_texture
from .context import Context
from .edges import Edges
from .framebuffer import check_drawn, free, new_framebuffer
from .options import RenderOptions, schedule_that_fits
from .passes import Frame, Passes
from .program import UNITS, Program
from .tiles import Tile
from .uniforms import picture_uniforms, tile_uniforms


class Sampler:
    """Draws samples of pixels with one shader: holds its programs, textures and framebuffers in a context.

    A frame is drawn in the shader's passes where it has some, else at once. Raises UserError where the driver refuses
    the shader or the weights.
    """

    vertex_shader: NumberedText = (VERTEX_SHADER, ())
    """Places what is drawn: one triangle that covers the tile."""
    context: Context
    shader: Shader
    edges: Edges | None
    """Edges of a mesh that are drawn over every picture, but not over data."""
    compile_seconds: float
    """Seconds of compiling, linking and a first draw of one pixel, where drivers do most of their compiling."""

    def __init__(self, context: Context, shader: Shader, shading: str = "phong") -> None:
        """Compile what draws the `shading`; what another one needs besides is compiled when it is first drawn."""
        self.context = context
        self.shader = shader
        self.edges = None
        self._edges_are_drawn = False
        self._framebuffer: moderngl.Framebuffer | None = None
        self._passes: Passes | None = None
        self._level, self._looks_first = 1, False
        self._jitter = 0.0, 0.0
        self._scattered: NDArray[np.float32] | None = None
        """Where the pixels of what is drawn lie in the picture, (H, W, 2); None where they are a tile of it."""
        self._weights: moderngl.Texture | None = None
        self._cells: moderngl.Texture3D | None = None
        self._programs: dict[str, Program] = {}
        self._colours = _colour_passes(shading)
        """Names of the last passes of a frame, those of its shading."""
        self._cells_time = 0.0
        """Of the grid of cells that the texture holds."""
        start = time.perf_counter()
        with context as gl:
            try:
                names = ("main",) if shader.passes is None else (*tuple(PASSES)[:-1], *self._colours)
                for name in names:
                    self._programs[name] = self._compiled(gl, name)
                self._take_vertices(gl)
                if shader.weights is not None:
                    self._weights = weight_texture(gl, shader.weights)
                if shader.cells is not None:
                    self._cells = cell_texture(gl, shader.cells.grid())
                if shader.passes is not None:
                    self._passes = Passes(gl)
                self.draw(self._target(gl, (1, 1)), (0, 0, 1, 1))
                check_drawn(gl, context.renderer)
            except UserError:
                Sampler.release(self)  # a subclass frees what is its own
                raise
        self.compile_seconds = time.perf_counter() - start

    def schedule(self, options: RenderOptions) -> tuple[tuple[int, ...], int]:
        """Return the iterations of each level, and the rounds, that will be drawn.

        They are those of the options, or what software GL's loop limit allows. Raises UserError where the limit
        forbids even one round.
        """
        iterations = options.resolved_iterations(self.shader.iterations)
        rounds = self.wanted_rounds(options)
        if not self.context.software:
            return iterations, rounds
        level, normal_level = options.resolved_levels(self.shader.levels)
        shaded = max(level, normal_level) if options.split else normal_level
        return schedule_that_fits(self.shader, level, shaded, iterations, rounds, options.schedule)

    def wanted_rounds(self, options: RenderOptions) -> int:
        """Return the rounds of the options, or the shader's default."""
        if options.rounds is not None:
            return options.rounds
        default = self._default("rounds")
        return int(np.frombuffer(default, np.int32)[0]) if default else 1

    def default(self, name: str) -> tuple[float, ...]:
        """Return the shader's default of a uniform of floats; () where the shader has no such uniform in use."""
        return tuple(np.frombuffer(self._default(name), np.float32).tolist())

    def prepare(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, jitter: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Set the uniforms of a picture of `size` (width, height), for `draw`; the context must be current.

        jitter: offset of the sample from the pixel's centre, in pixels.
        """
        if self.shader.passes is not None:
            self._hold_colour_passes(_colour_passes(options.shade))
            self._level, normal_level = options.resolved_levels(self.shader.levels)
            self._looks_first = self._level == normal_level and options.schedule == "relaxed"
            self._looks_first &= self.shader.looks_first and self._skips(options)
        self._jitter = jitter
        self._reset_uniforms()
        self._hold_cells(options.time)
        self._write(self._option_uniforms(options))
        self._write(picture_uniforms(size, camera, jitter))
        self._edges_are_drawn = options.shade != "data"
        if self.edges is not None:
            self.edges.prepare(size, camera, jitter)

    def draw(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int] = (0, 0)) -> None:
        """Draw one sample of a tile's pixels, after `prepare` in the same `with context:`.

        target: RGBA32F, with a depth buffer. corner: the target's pixel that the tile's lower left corner falls on.
        """
        target.use()
        target.viewport = (*corner, *tile[2:])
        target.clear(viewport=target.viewport)
        self._draw_surface(target, tile, corner)
        if self.edges is not None and self._edges_are_drawn:
            self.edges.draw(target, tile, corner)

    def release(self) -> None:
        """Free the framebuffer, the textures and the program in the context."""
        with self.context:
            if self._framebuffer is not None:
                free(self._framebuffer)
            for held in (self._weights, self._cells, self._passes):
                if held is not None:
                    held.release()
            for program in self._programs.values():
                program.release()

    def _compiled(self, gl: moderngl.Context, name: str) -> Program:
        """Compile the program of a pass, or "main", that of a shader without passes. Raises ShaderError."""
        text = (self.shader.text, self.shader.files) if self.shader.passes is None else self.shader.passes[name]
        return Program(gl, self.vertex_shader, text, self.context.renderer)

    def _hold_colour_passes(self, names: tuple[str, ...]) -> None:
        """Let frames end with passes, which are compiled where they are not yet. Raises ShaderError."""
        for name in names:
            if name not in self._programs:
                start = time.perf_counter()
                self._programs[name] = self._compiled(self.context.gl, name)
                self._programs[name].take()
                self.compile_seconds += time.perf_counter() - start
        self._colours = names

    def _take_vertices(self, gl: moderngl.Context) -> None:
        """Tell the programs, which are compiled, what they draw."""
        for program in self._programs.values():
            program.take()

    def _default(self, name: str) -> bytes:
        """Return the shader's default of a uniform; b"" where no program makes use of it."""
        return next((program.defaults[name] for program in self._programs.values() if name in program.defaults), b"")

    def _target(self, gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
        """Return the framebuffer that tiles are drawn into, of `size` (width, height)."""
        # One format for every draw: software GL compiles the shader again for each new one.
        if self._framebuffer is None or self._framebuffer.size != size:
            if self._framebuffer is not None:
                free(self._framebuffer)
            self._framebuffer = new_framebuffer(gl, size)
        return self._framebuffer

    def _reset_uniforms(self) -> None:
        """Give every uniform the shader's default."""
        for program in self._programs.values():
            program.reset()

    def _write(self, values: dict[str, object]) -> None:
        """Write uniforms, name -> value, of whatever this renderer draws with."""
        for program in self._programs.values():
            program.write(values)

    def _option_uniforms(self, options: RenderOptions) -> dict[str, object]:
        """Return name -> value of the uniforms that differ from the shader's defaults by the options."""
        level, normal_level = options.resolved_levels(self.shader.levels)
        iterations, rounds = self.schedule(options)
        top, bottom = options.background or (None, None)
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
            "split": options.split,
            "time": options.time,
            "light": options.light,
            "background_top": top,
            "background_bottom": bottom,
        }
        if self.shader.cells is not None:
            count = self.shader.cells.count if self._skips(options) else 0
            values |= {"cell_count": count, "cells_half": self.shader.cells.half}
        return {name: value for name, value in values.items() if value is not None}

    def _skips(self, options: RenderOptions) -> bool:
        """Whether the grid of cells is of the surface that is drawn, in its bands and at its time."""
        level, _ = options.resolved_levels(self.shader.levels)
        cells, whole = self.shader.cells, level == self.shader.levels and options.delta_scale == 1.0
        return cells is not None and whole and cells.holds(options.time)

    def _hold_cells(self, time: float) -> None:
        """Put the grid of cells for a time into the texture that rays read."""
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
        self._write(tile_uniforms(tile, corner) | {"scattered": self._scattered is not None})
        if self.shader.passes is None:
            self._programs["main"].draw(3)
            return
        assert self._passes is not None
        packs = self.context.software
        frame = Frame(
            self._programs, self._colours, self._level, self._looks_first, packs, self._jitter, self._scattered
        )
        self._passes.draw(frame, target, tile, corner)


def _colour_passes(shading: str) -> tuple[str, ...]:
    """Return the names of the passes that colour what rays have met."""
    return ("floor", "studio") if shading == "studio" else ("colour",)
