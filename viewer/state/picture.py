"""The picture of a window: drawn coarsely at once, then with every pixel, then with more samples of each."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from ... import glsl
from ..draw.adaptive import add_samples, sample_counts, sample_points
from ..draw.camera import Camera
from ..draw.compile import VERTEX_SHADER
from ..draw.context import Context
from ..draw.framebuffer import free, read_pixels, texture_of
from ..draw.options import RenderOptions
from ..draw.renderer import Renderer
from ..draw.supersampling import golden_order, jitters, to_linear
from ..draw.tiles import TILE_SIDE, Tile

SAMPLE_SHADER = "#version 330\n" + glsl.load("accumulate.glsl")
"""Adds a sample of a tile to the fine picture."""
PRESENT_SHADER = "#version 330\n" + glsl.load("window.glsl")
"""Puts both pictures onto the screen."""
FIRST_SIDE = 64
"""Pixels per side of the tiles that are drawn first."""
FAST_TILE = 0.01
"""Seconds of a tile below which the next row's tiles are larger."""


@dataclass(frozen=True)
class Scene:
    """What a picture is to show."""

    size: tuple[int, int]
    """(width, height) in pixels."""
    camera: Camera
    """Where it is seen from, in both halves."""
    options: RenderOptions
    """Options of the whole picture, or of its left half."""
    right: RenderOptions | None = None
    """Options of the right half; None if the picture is not split."""

    def at(self, camera: Camera, options: RenderOptions) -> "Scene":
        """Return the scene through another camera, and with other options at their time, in both halves."""
        right = None if self.right is None else replace(self.right, time=options.time)
        return replace(self, camera=camera, options=options, right=right)

    def panes(self, width: int) -> list[tuple[int, int, RenderOptions]]:
        """Return the panes of a picture that is `width` pixels wide: (first column, one past the last, options)."""
        if self.right is None or width < 2:
            return [(0, width, self.options)]
        return [(0, width // 2, self.options), (width // 2, width, self.right)]


class Picture:
    """Draws scenes and keeps what is drawn: a coarse picture, and a fine one as sums of samples in linear light."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._side = FIRST_SIDE
        self._refinement: Iterator[None] | None = None
        self.frame_seconds = 0.0
        """What the first sample of every pixel has taken, of the picture that is refined."""
        with context as gl:
            self._sample, self._present = (
                gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=text)
                for text in (SAMPLE_SHADER, PRESENT_SHADER)
            )
            self._sampling, self._presenting = (
                gl.vertex_array(program, []) for program in (self._sample, self._present)
            )
            self._coarse, self._fine, self._tile = (_buffer(gl, (1, 1)) for _ in range(3))

    @property
    def refining(self) -> bool:
        """Whether `refine` has begun what `more` has not ended yet."""
        return self._refinement is not None

    def sketch(self, renderer: Renderer, scene: Scene, scale: float) -> None:
        """Draw the scene at once, with fewer pixels by the factor `scale` per side, and forget what was refined."""
        self._refinement = None
        size = max(1, round(scene.size[0] / scale)), max(1, round(scene.size[1] / scale))
        with self._context as gl:
            self._coarse, self._fine = _resized(gl, self._coarse, size), _resized(gl, self._fine, scene.size)
            self._fine.clear()
            for left, right, options in scene.panes(size[0]):
                renderer.prepare(size, scene.camera, options)
                renderer.draw(self._coarse, (left, 0, right - left, size[1]), (left, 0))
            gl.finish()

    def refine(self, renderer: Renderer, scene: Scene) -> None:
        """Begin to draw every pixel of the scene with all its samples; `more` does the work."""
        self._refinement = self._refined_tiles(renderer, scene)

    def more(self, seconds: float) -> None:
        """Go on for so long with what `refine` has begun."""
        end = time.perf_counter() + seconds
        with self._context:
            while self._refinement is not None and time.perf_counter() < end:
                if next(self._refinement, self) is self:
                    self._refinement = None

    def show(
        self, corner: tuple[int, int], size: tuple[int, int], split: bool, onto: moderngl.Framebuffer | None = None
    ) -> None:
        """Put what is drawn so far onto the screen, or onto another framebuffer.

        corner: (x, y from the bottom) of the place there, in pixels. size: its (width, height).
        split: a line is drawn between the halves. The screen has 8 bits, for which colours are dithered.
        """
        with self._context as gl:
            for unit, (name, buffer) in enumerate((("coarse", self._coarse), ("fine", self._fine))):
                texture_of(buffer).use(unit)
                self._present[name] = unit
            self._present["corner"] = corner
            self._present["size"] = size
            self._present["divider"] = size[0] // 2 if split else -9.0
            self._present["dithered"] = onto is None
            target = onto or gl.screen
            target.use()
            target.viewport = (*corner, *size)
            self._presenting.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        with self._context:
            for buffer in (self._coarse, self._fine, self._tile):
                free(buffer)
            for held in (self._sampling, self._presenting, self._sample, self._present):
                held.release()

    def _refined_tiles(self, renderer: Renderer, scene: Scene) -> Iterator[None]:
        """Add the samples of every pixel to the fine picture, and yield after each tile."""
        self.frame_seconds = 0.0
        if not renderer.adapts(scene.options):
            offsets = jitters(scene.options.samples)
            for k, offset in enumerate(offsets[golden_order(len(offsets))]):
                for start, _ in self._sampled_tiles(renderer, scene, offset):
                    self.frame_seconds += (time.perf_counter() - start) * (k == 0)
                    yield
            return
        seen = np.empty((scene.size[1], scene.size[0], 4), np.float32)
        for start, (x, y, width, height) in self._sampled_tiles(renderer, scene, jitters(1)[0]):
            seen[y : y + height, x : x + width] = read_pixels(self._tile, (width, height))
            self.frame_seconds += time.perf_counter() - start
            yield
        yield from self._refined_pixels(renderer, scene, sample_counts(seen, scene.options.samples))

    def _sampled_tiles(
        self, renderer: Renderer, scene: Scene, offset: NDArray[np.float32]
    ) -> Iterator[tuple[float, Tile]]:
        """Add one sample of every pixel to the fine picture; yield when each tile was begun, and the tile."""
        width, height = scene.size
        y = 0
        while y < height:
            side, rows = self._side, min(self._side, height - y)
            for left, right, options in scene.panes(width):
                for x in range(left, right, side):
                    tile = (x, y, min(side, right - x), rows)
                    start = time.perf_counter()
                    self._add(renderer, scene, options, tile, (float(offset[0]), float(offset[1])))
                    if time.perf_counter() - start < FAST_TILE and tile[2] == rows == side:
                        self._side = min(TILE_SIDE, 2 * side)
                    yield start, tile
            y += rows

    def _refined_pixels(self, renderer: Renderer, scene: Scene, counts: NDArray[np.int64]) -> Iterator[None]:
        """Add further samples, as many of each pixel as `counts` (H, W) says, to the fine picture; yield meanwhile."""
        sums = read_pixels(self._fine, scene.size).copy()
        for left, right, options in scene.panes(scene.size[0]):
            pane = counts * ((np.arange(scene.size[0]) >= left) & (np.arange(scene.size[0]) < right))
            places, pixels = sample_points(pane)
            done = 0
            while done < len(places):
                part = np.s_[done : done + self._side**2]
                start = time.perf_counter()
                renderer.prepare(scene.size, scene.camera, options)
                light = to_linear(renderer.samples_at(places[part]), transparent=False)
                light[:, 3] = 1.0  # alpha counts the samples
                add_samples(sums, pixels[part], light)
                texture_of(self._fine).write(sums.tobytes())
                if time.perf_counter() - start < FAST_TILE:
                    self._side = min(TILE_SIDE, 2 * self._side)
                done = part.stop
                yield

    def _add(
        self, renderer: Renderer, scene: Scene, options: RenderOptions, tile: Tile, offset: tuple[float, float]
    ) -> None:
        """Draw one sample of a tile and add it to the fine picture."""
        gl = self._context.gl
        side = max(tile[2:])
        if side > min(self._tile.size):
            self._tile = _resized(gl, self._tile, (side, side))
        renderer.prepare(scene.size, scene.camera, options, offset)
        renderer.draw(self._tile, tile)
        texture_of(self._tile).use(0)
        self._sample["corner"] = tile[:2]
        self._fine.use()
        self._fine.viewport = tile
        gl.enable(moderngl.BLEND)
        gl.blend_func = moderngl.ONE, moderngl.ONE
        self._sampling.render(moderngl.TRIANGLES, vertices=3)
        gl.disable(moderngl.BLEND)
        gl.finish()


def _buffer(gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
    """Return a new framebuffer of RGBA32F pixels with a depth buffer."""
    texture = gl.texture(size, 4, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return gl.framebuffer([texture], gl.depth_renderbuffer(size))


def _resized(gl: moderngl.Context, buffer: moderngl.Framebuffer, size: tuple[int, int]) -> moderngl.Framebuffer:
    """Return the framebuffer if it has this size, else free it and return a new one."""
    if buffer.size == size:
        return buffer
    free(buffer)
    return _buffer(gl, size)
