"""Draws a baked shader off screen: tiles, supersampling, and a refusal of what the driver would draw wrong."""

import time
from collections.abc import Callable, Iterator

import moderngl
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from ...codegen.targets.shader import Shader
from ...model.errors import UserError
from .camera import Camera
from .compile import VERTEX_SHADER, Numbered, compiled, weight_texture
from .context import Context
from .edges import Edges
from .framebuffer import check_drawn, free, read
from .options import SHADINGS, RenderOptions, schedule_that_fits
from .supersampling import Image, from_linear, jitters, to_linear

TILE = 512
"""Pixels per side of one draw: bounds memory, a GPU watchdog's patience, and the wait for Ctrl-C."""
MAX_SIDE = 16_384
Part = tuple[int, int, int, int]
WHOLE = ("level", "normal_level", "iterations", "rounds", "shading", "plain")
FRAME = ("resolution", "origin", "jitter", "camera", "focal")


class Renderer:
    """A compiled shader, its weight texture and one RGBA32F framebuffer in `context`.

    compile_seconds: compiling, linking and a first draw of one pixel, where drivers do most of their compiling.
    edges: drawn over every picture, but not over data.
    Raises UserError where the driver refuses the shader or the weights.
    """

    vertex_shader: Numbered = (VERTEX_SHADER, ())

    def __init__(self, context: Context, shader: Shader) -> None:
        self.context, self.shader = context, shader
        self._framebuffer: moderngl.Framebuffer | None = None
        self._weights: moderngl.Texture | None = None
        self.edges: Edges | None = None
        self._edged = False
        start = time.perf_counter()
        with context as gl:
            self._program = compiled(gl, self.vertex_shader, (shader.text, shader.files), context.renderer)
            self._vertices = self._vertex_array(gl)
            self._defaults = {
                name: uniform.read()
                for name in self._program
                if isinstance(uniform := self._program[name], moderngl.Uniform)
            }
            try:
                if shader.weights is not None:
                    self._weights = weight_texture(gl, shader.weights)
                self.draw(self._target(gl, (1, 1)), (0, 0, 1, 1))
                check_drawn(gl, context.renderer)
            except UserError:
                Renderer.release(self)
                raise
        self.compile_seconds = time.perf_counter() - start

    def schedule(self, options: RenderOptions) -> tuple[tuple[int, ...], int]:
        """Steps of each level and rounds that will be drawn: those asked for, or what software GL's loop limit allows.

        Raises UserError where the limit forbids even one round.
        """
        steps, rounds = options.steps(self.shader.iterations), self.wanted_rounds(options)
        if not self.context.software:
            return steps, rounds
        level, normal_level = options.traced(self.shader.levels)
        shaded = max(level, normal_level) if options.split else normal_level
        return schedule_that_fits(self.shader, level, shaded, steps, rounds)

    def wanted_rounds(self, options: RenderOptions) -> int:
        """Rounds asked for, or the shader's default."""
        default = self._defaults.get("rounds")  # a driver may leave out what the shader does not use
        return options.rounds or (int(np.frombuffer(default, np.int32)[0]) if default else 1)

    def render(self, size: tuple[int, int], camera: Camera, options: RenderOptions | None = None) -> Image:
        """(H, W, 4) float32 for size (W, H), top row first.

        rgb is sRGB-encoded, alpha the share of samples that hit; shading "data" is raw, from the pixels' centres.
        Supersampling averages in linear light. A progress bar shows on a terminal where it takes long.
        """
        options = options or RenderOptions()
        check_size(size)
        image = np.empty((size[1], size[0], 4), np.float32)
        parts = list(tiles(size))
        offsets = _offsets(options)
        with tqdm(total=len(parts) * len(offsets), desc="render", delay=2, leave=False, disable=None) as bar:
            for x, y, width, height in parts:
                image[y : y + height, x : x + width] = self.tile(
                    (x, y, width, height), size, camera, options, bar.update
                )
        return image[::-1]

    def tile(
        self,
        part: Part,
        size: tuple[int, int],
        camera: Camera,
        options: RenderOptions,
        sampled: Callable[[], object] = lambda: None,
    ) -> Image:
        """The part (x, y from the bottom, width, height; at most TILE a side) of what `render` gives, bottom row first.

        sampled: called after each sample.
        """
        offsets = _offsets(options)
        total: Image | None = None
        with self.context as gl:
            _ = gl.error  # forgets what others left
            target = self._target(gl, (min(size[0], TILE), min(size[1], TILE)))
            for offset in offsets:
                self.prepare(size, camera, options, (float(offset[0]), float(offset[1])))
                self.draw(target, part)
                sample = read(target, part[2:])
                if len(offsets) > 1 or options.transparent:
                    sample = to_linear(sample, options.transparent)
                total = sample if total is None else total + sample
                sampled()
            check_drawn(gl, self.context.renderer)
        assert total is not None
        if len(offsets) > 1 or options.transparent:
            total = from_linear(total / len(offsets), options.transparent)
        return total

    def prepare(
        self, size: tuple[int, int], camera: Camera, options: RenderOptions, jitter: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Sets every uniform for `draw`; the context must be current."""
        self._set_options(options)
        self._set("resolution", (float(size[0]), float(size[1])))
        self._set("camera", camera.matrix().T)  # GL reads column by column
        self._set("focal", camera.focal)
        self._set("jitter", jitter)
        self._edged = options.shading != "data"
        if self.edges is not None:
            self.edges.prepare(size, camera, jitter)

    def timed(self, size: tuple[int, int], camera: Camera, options: RenderOptions) -> tuple[float, float]:
        """Seconds of one sample of a picture that stays with the driver: by the clock on the wall, by the GPU's own."""
        check_size(size)
        of_gpu = 0.0
        with self.context as gl:
            query = gl.query(time=True)
            target = self._target(gl, (min(size[0], TILE), min(size[1], TILE)))
            gl.finish()
            start = time.perf_counter()
            self.prepare(size, camera, options)
            for part in tiles(size):
                with query:
                    self.draw(target, part)
                of_gpu += query.elapsed / 1e9
            check_drawn(gl, self.context.renderer)
            return time.perf_counter() - start, of_gpu

    def default(self, name: str) -> tuple[float, ...]:
        """The shader's default of a uniform; () where the shader has none of that name, or makes no use of it."""
        return tuple(np.frombuffer(self._defaults.get(name) or b"", np.float32).tolist())

    def release(self) -> None:
        """Frees what is held in the context."""
        with self.context:
            if self._framebuffer is not None:
                free(self._framebuffer)
            if self._weights is not None:
                self._weights.release()
            self._vertices.release()
            self._program.release()

    def _set_options(self, options: RenderOptions) -> None:
        for name, default in self._defaults.items():
            if name not in FRAME and default is not None:
                self._uniform(name).write(default)
        level, normal_level = options.traced(self.shader.levels)
        self._set("level", level)
        self._set("normal_level", normal_level)
        steps, rounds = self.schedule(options)
        self._set("iterations", steps)
        self._set("rounds", rounds)
        self._set("delta", tuple(delta * options.delta_scale for delta in self.shader.deltas))
        self._set("shading", SHADINGS.index(options.shading))
        self._set("plain", options.plain)
        self._set("split", options.split)
        if options.step_scale is not None:
            self._set("step_scale", options.step_scale)
        if options.light is not None:
            self._set("light", options.light)
        if options.background is not None:
            self._set("background_top", options.background[0])
            self._set("background_bottom", options.background[1])

    def _uniform(self, name: str) -> moderngl.Uniform:
        uniform = self._program[name]
        assert isinstance(uniform, moderngl.Uniform)
        return uniform

    def _set(self, name: str, value: object) -> None:
        """Writes a uniform; one that the driver optimised away is skipped, an array's unused tail is cut."""
        if name not in self._program:
            return
        kind = np.int32 if name in WHOLE else np.float32
        data = np.ascontiguousarray(value, kind).tobytes()
        self._uniform(name).write(data[: len(self._defaults[name])])

    def _target(self, gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
        # One format for every draw: software GL compiles the shader again for each new one.
        old = self._framebuffer
        if old is None or old.size != size:
            self._framebuffer = gl.framebuffer([gl.texture(size, 4, dtype="f4")], gl.depth_renderbuffer(size))
            _ = gl.error  # moderngl binds again what was bound before, which may be gone; a bad framebuffer raises
            self._framebuffer.use()
            if old is not None:
                free(old)
        assert self._framebuffer is not None
        return self._framebuffer

    def draw(self, target: moderngl.Framebuffer, part: Part, at: tuple[int, int] = (0, 0)) -> None:
        """One sample of a part (x, y from the bottom, width, height) into a framebuffer, `at` a place of it.

        After `prepare`, in the same `with context:`. target: RGBA32F, with a depth buffer.
        """
        target.use()
        target.viewport = (*at, *part[2:])
        target.clear(viewport=target.viewport)
        self._draw(target, part, at)
        if self.edges is not None and self._edged:
            self.edges.draw(target, part, at)

    def _draw(self, target: moderngl.Framebuffer, part: Part, at: tuple[int, int]) -> None:
        if self._weights is not None:
            self._weights.use(0)
        self._set("origin", (float(part[0] - at[0]), float(part[1] - at[1])))
        self._vertices.render(moderngl.TRIANGLES, vertices=3)

    def _vertex_array(self, gl: moderngl.Context) -> moderngl.VertexArray:
        return gl.vertex_array(self._program, [])


def check_size(size: tuple[int, int]) -> None:
    """Raises UserError where a picture of `size` (width, height) cannot be drawn."""
    if not all(1 <= side <= MAX_SIDE for side in size):
        raise UserError(f"size {size[0]}x{size[1]}: each side from 1 to {MAX_SIDE} pixels")


def tiles(size: tuple[int, int]) -> Iterator[Part]:
    """Parts (x, y, width, height) of at most TILE a side that make up a picture (width, height)."""
    for y in range(0, size[1], TILE):
        for x in range(0, size[0], TILE):
            yield x, y, min(TILE, size[0] - x), min(TILE, size[1] - y)


def _offsets(options: RenderOptions) -> NDArray[np.float32]:
    return jitters(1 if options.shading == "data" else options.samples)
