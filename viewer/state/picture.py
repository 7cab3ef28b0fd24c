"""The picture of a window: drawn coarsely at once, then every pixel, then more samples per pixel."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from ... import glsl
from ..draw.adaptive import add_samples, first_offset, sample_counts, sample_points
from ..draw.camera import Camera
from ..draw.compile import VERTEX_SHADER
from ..draw.context import Context
from ..draw.framebuffer import free, read_pixels, texture_of
from ..draw.options import RenderOptions
from ..draw.renderer import Renderer
from ..draw.supersampling import golden_order, jitters, to_linear
from ..draw.tiles import TILE_SIDE, Tile

FIRST_SIDE = 64
"""Side of the first tiles, pixels."""
FAST_TILE = 0.01
"""Tiles grow after a tile that takes less time than this, seconds."""


@dataclass(frozen=True)
class Scene:
    """The content of a picture: size, camera, options."""

    size: tuple[int, int]
    """(width, height) in pixels."""
    camera: Camera
    options: RenderOptions
    """Of the whole picture, or of its left half."""
    right: RenderOptions | None = None
    """Of the right half; None if the picture is not split."""

    def at(self, camera: Camera, options: RenderOptions) -> "Scene":
        """Return the scene with another camera and options, whose time holds for both halves."""
        right = None if self.right is None else replace(self.right, time=options.time)
        return replace(self, camera=camera, options=options, right=right)

    def panes(self, width: int) -> list[tuple[int, int, RenderOptions]]:
        """Return (first column, one past the last, options) of each pane of a picture `width` pixels wide."""
        if self.right is None or width < 2:
            return [(0, width, self.options)]
        return [(0, width // 2, self.options), (width // 2, width, self.right)]


class Picture:
    """Draws scenes, and keeps a coarse picture and a fine one, sums of samples in linear light."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._side = FIRST_SIDE
        self._refinement: Iterator[None] | None = None
        self.frame_seconds = 0.0
        """Time of the first sample of every pixel in the refinement, seconds."""
        with context as gl:
            self._add_program, self._show_program = (
                gl.program(vertex_shader=VERTEX_SHADER, fragment_shader="#version 330\n" + glsl.load(name))
                for name in ("accumulate.glsl", "window.glsl")
            )
            self._adding, self._showing = (
                gl.vertex_array(program, []) for program in (self._add_program, self._show_program)
            )
            self._coarse, self._fine, self._tile = (_buffer(gl, (1, 1)) for _ in range(3))

    @property
    def refining(self) -> bool:
        """Whether `more` has work left."""
        return self._refinement is not None

    def sketch(self, renderer: Renderer, scene: Scene, scale: float) -> None:
        """Draw the scene at once, with 1 / `scale` of the pixels per side, and discard the refinement."""
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
        """Begin to draw every pixel with all its samples; `more` does the work."""
        self._refinement = self._refined_tiles(renderer, scene)

    def more(self, seconds: float) -> None:
        """Continue the refinement for some seconds."""
        end = time.perf_counter() + seconds
        with self._context:
            while self._refinement is not None and time.perf_counter() < end:
                if next(self._refinement, self) is self:
                    self._refinement = None

    def show(
        self, corner: tuple[int, int], size: tuple[int, int], split: bool, onto: moderngl.Framebuffer | None = None
    ) -> None:
        """Draw the picture onto the screen, dithered to 8 bits, or onto another framebuffer.

        corner, size: (x, y from the bottom) and (width, height) of the place, pixels. split: draw a line between the
        halves.
        """
        program = self._show_program
        with self._context as gl:
            for unit, (name, buffer) in enumerate((("coarse", self._coarse), ("fine", self._fine))):
                texture_of(buffer).use(unit)
                program[name] = unit
            program["corner"], program["size"], program["dithered"] = corner, size, onto is None
            program["divider"] = size[0] // 2 if split else -9.0
            target = onto or gl.screen
            target.use()
            target.viewport = (*corner, *size)
            self._showing.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        with self._context:
            for buffer in (self._coarse, self._fine, self._tile):
                free(buffer)
            for resource in (self._adding, self._showing, self._add_program, self._show_program):
                resource.release()

    def _refined_tiles(self, renderer: Renderer, scene: Scene) -> Iterator[None]:
        """Add all samples to the fine picture, and yield after each tile."""
        self.frame_seconds = 0.0
        adapts = renderer.adapts(scene.options)
        samples = scene.options.samples
        offsets = first_offset(samples) if adapts else jitters(samples)
        seen = np.empty((scene.size[1], scene.size[0], 4), np.float32)
        for k, offset in enumerate(offsets[golden_order(len(offsets))].tolist()):
            for start, (x, y, width, height) in self._sampled_tiles(renderer, scene, (offset[0], offset[1])):
                if adapts:
                    seen[y : y + height, x : x + width] = read_pixels(self._tile, (width, height))
                self.frame_seconds += (time.perf_counter() - start) * (k == 0)
                yield
        if adapts:
            yield from self._refined_pixels(renderer, scene, sample_counts(seen, samples))

    def _sampled_tiles(
        self, renderer: Renderer, scene: Scene, offset: tuple[float, float]
    ) -> Iterator[tuple[float, Tile]]:
        """Add one sample of every pixel to the fine picture; yield the start time of each tile, and the tile."""
        width, height = scene.size
        y = 0
        while y < height:
            side, rows = self._side, min(self._side, height - y)
            if side > self._tile.width:
                self._tile = _resized(self._context.gl, self._tile, (side, side))
            for left, right, options in scene.panes(width):
                for x in range(left, right, side):
                    tile = (x, y, min(side, right - x), rows)
                    start = time.perf_counter()
                    renderer.prepare(scene.size, scene.camera, options, offset)
                    renderer.draw(self._tile, tile)
                    self._add(tile)
                    if time.perf_counter() - start < FAST_TILE and tile[2] == rows == side:
                        self._side = min(TILE_SIDE, 2 * side)
                    yield start, tile
            y += rows

    def _refined_pixels(self, renderer: Renderer, scene: Scene, counts: NDArray[np.int64]) -> Iterator[None]:
        """Add `counts` (H, W) further samples of each pixel to the fine picture; yield after each batch."""
        sums = read_pixels(self._fine, scene.size).copy()
        columns = np.arange(scene.size[0])
        for left, right, options in scene.panes(scene.size[0]):
            points, pixels = sample_points(counts * ((columns >= left) & (columns < right)))
            done = 0
            while done < len(points):
                part = np.s_[done : done + self._side**2]
                start = time.perf_counter()
                renderer.prepare(scene.size, scene.camera, options)
                light = to_linear(renderer.samples_at(points[part]), transparent=False)
                light[:, 3] = 1.0  # alpha counts the samples
                add_samples(sums, pixels[part], light)
                texture_of(self._fine).write(sums.tobytes())
                if time.perf_counter() - start < FAST_TILE:
                    self._side = min(TILE_SIDE, 2 * self._side)
                done = part.stop
                yield

    def _add(self, tile: Tile) -> None:
        """Add the sample of a tile to the fine picture."""
        gl = self._context.gl
        texture_of(self._tile).use(0)
        self._add_program["corner"] = tile[:2]
        self._fine.use()
        self._fine.viewport = tile
        gl.enable(moderngl.BLEND)
        gl.blend_func = moderngl.ONE, moderngl.ONE
        self._adding.render(moderngl.TRIANGLES, vertices=3)
        gl.disable(moderngl.BLEND)
        gl.finish()


def _buffer(gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
    """Return an RGBA32F framebuffer with a depth buffer and linear filtering."""
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
