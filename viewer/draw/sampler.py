"""Draws one sample of a picture's pixels with a baked shader, refusing what the driver would draw wrong."""

import time

import moderngl
import numpy as np

from ...codegen.targets.shader import PASSES, NumberedText, Shader
from ...codegen.targets.uniforms import SCHEDULES, SHADINGS
from ...model.errors import UserError
from .camera import Camera
from .compile import VERTEX_SHADER, cell_texture, weight_texture
from .context import Context
from .edges import Edges
from .framebuffer import check_drawn, free, set_color_mask, texture_of
from .options import RenderOptions, schedule_that_fits
from .program import UNITS, Program
from .tiles import TILE_SIDE, Tile
from .uniforms import picture_uniforms, tile_uniforms

ALWAYS, WHERE_NEAR = "1", "<="
"""Depth tests of a pass: it draws, and chooses where the next one does; it draws where the one before has said so."""


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
        self._rays: moderngl.Framebuffer | None = None
        self._weights: moderngl.Texture | None = None
        self._cells: moderngl.Texture3D | None = None
        self._places: moderngl.Texture | None = None
        self._programs: dict[str, Program] = {}
        self._colour = _colour_pass(shading)
        """Name of the last pass of a frame."""
        self._cells_time = 0.0
        """Of the grid of cells that the texture holds."""
        start = time.perf_counter()
        with context as gl:
            try:
                names = ("main",) if shader.passes is None else (*tuple(PASSES)[:-1], self._colour)
                for name in names:
                    self._programs[name] = self._compiled(gl, name)
                self._take_vertices(gl)
                if shader.weights is not None:
                    self._weights = weight_texture(gl, shader.weights)
                if shader.cells is not None:
                    self._cells = cell_texture(gl, shader.cells.grid())
                if shader.passes is not None:
                    self._places = gl.texture((TILE_SIDE, TILE_SIDE), 2, dtype="f4")
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
            self._hold_colour_pass(_colour_pass(options.shading))
        self._reset_uniforms()
        self._hold_cells(options.time)
        self._write(self._option_uniforms(options))
        self._write(picture_uniforms(size, camera, jitter))
        self._edges_are_drawn = options.shading != "data"
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
            for framebuffer in (self._framebuffer, self._rays):
                if framebuffer is not None:
                    free(framebuffer)
            for texture in (self._weights, self._cells, self._places):
                if texture is not None:
                    texture.release()
            for program in self._programs.values():
                program.release()

    def _compiled(self, gl: moderngl.Context, name: str) -> Program:
        """Compile the program of a pass, or "main", that of a shader without passes. Raises ShaderError."""
        text = (self.shader.text, self.shader.files) if self.shader.passes is None else self.shader.passes[name]
        return Program(gl, self.vertex_shader, text, self.context.renderer)

    def _hold_colour_pass(self, name: str) -> None:
        """Let frames end with a pass, which is compiled where it is not yet. Raises ShaderError."""
        if name not in self._programs:
            start = time.perf_counter()
            self._programs[name] = self._compiled(self.context.gl, name)
            self._programs[name].take()
            self.compile_seconds += time.perf_counter() - start
        self._colour = name

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
            self._framebuffer = _new_framebuffer(gl, size, self._framebuffer)
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
            "shading": SHADINGS.index(options.shading),
            "plain": options.plain,
            "split": options.split,
            "time": options.time,
            "light": options.light,
            "background_top": top,
            "background_bottom": bottom,
        }
        if self.shader.cells is not None:
            empty = level == self.shader.levels and options.delta_scale == 1.0  # of that surface, in those bands
            empty &= self.shader.cells.holds(options.time)
            count = self.shader.cells.count if empty else 0
            values |= {"cell_count": count, "cells_half": self.shader.cells.half}
        return {name: value for name, value in values.items() if value is not None}

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
        self._write(tile_uniforms(tile, corner))
        if self.shader.passes is None:
            self._programs["main"].draw(3)
            return
        assert self._places is not None
        self._places.use(UNITS["places"])  # always: software GL compiles the shader again where it is not
        gl = self.context.gl
        needed = corner[0] + tile[2], corner[1] + tile[3]
        if self._rays is None or any(side < least for side, least in zip(self._rays.size, needed, strict=True)):
            self._rays = _new_framebuffer(gl, target.size, self._rays)
        gl.enable_only(moderngl.DEPTH_TEST)
        try:
            self._rays.use()
            self._rays.viewport = target.viewport
            self._draw_pass("near", ALWAYS)
            self._draw_pass("trace", WHERE_NEAR)
            target.use()
            texture_of(self._rays).use(UNITS["rays"])
            self._draw_pass("behind", ALWAYS)
            self._draw_pass(self._colour, WHERE_NEAR)
        finally:
            gl.depth_func = "<"
            gl.enable_only(moderngl.NOTHING)
        set_color_mask(target, (False,) * 4)
        target.clear(depth=1.0, viewport=target.viewport)
        set_color_mask(target, (True,) * 4)

    def _draw_pass(self, name: str, test: str) -> None:
        """Draw a pass into the framebuffer in use. test: ALWAYS or WHERE_NEAR."""
        self.context.gl.depth_func = test
        self._programs[name].draw(3)


def _colour_pass(shading: str) -> str:
    """Return the name of the pass that colours what rays have met."""
    return "studio" if shading == "studio" else "colour"


def _new_framebuffer(
    gl: moderngl.Context, size: tuple[int, int], old: moderngl.Framebuffer | None
) -> moderngl.Framebuffer:
    """Return an RGBA32F framebuffer with a depth buffer, and free the one whose place it takes."""
    new = gl.framebuffer([gl.texture(size, 4, dtype="f4")], gl.depth_renderbuffer(size))
    _ = gl.error  # moderngl binds again what was bound before, which may be gone; a bad framebuffer raises
    new.use()
    if old is not None:
        free(old)
    return new
