"""The picture of a window: coarse at once, then every pixel, then more samples of each, a few tiles at a time."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import moderngl
import numpy as np

from ... import glsl
from ..draw.camera import Camera
from ..draw.compile import VERTEX_SHADER
from ..draw.context import Context
from ..draw.framebuffer import free
from ..draw.options import RenderOptions
from ..draw.renderer import TILE, Part, Renderer
from ..draw.supersampling import jitters

SAMPLE_SHADER = f"""#version 330
uniform sampler2D tile;
uniform ivec2 corner;
out vec4 light;
{glsl.load("linear.glsl")}
void main() {{ light = vec4(linear(texelFetch(tile, ivec2(gl_FragCoord.xy) - corner, 0).rgb), 1.0); }}
"""
PRESENT_SHADER = f"""#version 330
uniform sampler2D coarse;
uniform sampler2D fine; // sums of linear light and, as alpha, how many samples there are
uniform vec2 corner;
uniform vec2 size;
uniform float divider;
out vec4 color;
{glsl.load("srgb.glsl")}
void main() {{
    vec2 place = (gl_FragCoord.xy - corner) / size;
    vec4 sum = texture(fine, place);
    color = sum.a > 0.0 ? vec4(srgb(sum.rgb / sum.a), 1.0) : vec4(texture(coarse, place).rgb, 1.0);
    if (abs(gl_FragCoord.x - corner.x - divider) < 1.0) color.rgb = mix(color.rgb, vec3(1.0), 0.55);
}}
"""
FIRST_SIDE = 64
QUICK = 0.01
"""Seconds of a tile below which the next row's tiles are larger."""


@dataclass(frozen=True)
class Scene:
    """size: (width, height) in pixels. options: of the picture. right: of its right half, where it is split."""

    size: tuple[int, int]
    camera: Camera
    options: RenderOptions
    right: RenderOptions | None = None

    def panes(self, width: int) -> list[tuple[int, int, RenderOptions]]:
        """(from, to, options) of columns of a picture of that width."""
        if self.right is None or width < 2:
            return [(0, width, self.options)]
        return [(0, width // 2, self.options), (width // 2, width, self.right)]


class Picture:
    """Draws scenes through a Renderer and keeps what is drawn, in linear light, as sums of samples."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._side = FIRST_SIDE
        self._work: Iterator[None] | None = None
        self._left, self._all = 0, 1
        with context as gl:
            self._sample, self._present = (
                gl.program(vertex_shader=VERTEX_SHADER, fragment_shader=text)
                for text in (SAMPLE_SHADER, PRESENT_SHADER)
            )
            self._sampling, self._presenting = (gl.vertex_array(each, []) for each in (self._sample, self._present))
            self._coarse, self._fine, self._tile = (_buffer(gl, (1, 1)) for _ in range(3))

    @property
    def refining(self) -> bool:
        """More calls of `refine` are needed."""
        return self._work is not None

    @property
    def progress(self) -> float:
        """Share of the refinement that is done."""
        return 1.0 - self._left / self._all

    def sketch(self, renderer: Renderer, scene: Scene, scale: float) -> None:
        """Draws the scene at once, with fewer pixels by the factor `scale` per side; forgets what was refined."""
        self._work = None
        size = max(1, round(scene.size[0] / scale)), max(1, round(scene.size[1] / scale))
        with self._context as gl:
            self._coarse, self._fine = _resized(gl, self._coarse, size), _resized(gl, self._fine, scene.size)
            self._fine.clear()
            for left, right, options in scene.panes(size[0]):
                renderer.prepare(size, scene.camera, options)
                renderer.draw(self._coarse, (left, 0, right - left, size[1]), (left, 0))
            gl.finish()

    def refine(self, renderer: Renderer, scene: Scene) -> None:
        """Begins to draw every pixel of the scene, and all its samples; `more` does the work."""
        self._work = self._refinement(renderer, scene)

    def more(self, seconds: float) -> None:
        """Goes on with what `refine` began, for so long."""
        end = time.perf_counter() + seconds
        with self._context:
            while self._work is not None and time.perf_counter() < end:
                if next(self._work, self) is self:
                    self._work = None

    def show(
        self, corner: tuple[int, int], size: tuple[int, int], split: bool, onto: moderngl.Framebuffer | None = None
    ) -> None:
        """Draws what there is onto the screen, `size` pixels from `corner` (x, y from the bottom)."""
        with self._context as gl:
            for unit, (name, buffer) in enumerate((("coarse", self._coarse), ("fine", self._fine))):
                _texture(buffer).use(unit)
                self._present[name] = unit
            self._present["corner"] = corner
            self._present["size"] = size
            self._present["divider"] = size[0] // 2 if split else -9.0
            target = onto or gl.screen
            target.use()
            target.viewport = (*corner, *size)
            self._presenting.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Frees what is held in the context."""
        with self._context:
            for buffer in (self._coarse, self._fine, self._tile):
                free(buffer)
            for thing in (self._sampling, self._presenting, self._sample, self._present):
                thing.release()

    def _refinement(self, renderer: Renderer, scene: Scene) -> Iterator[None]:
        width, height = scene.size
        offsets = jitters(scene.options.samples)
        offsets = offsets[np.argsort((0.5 + np.arange(len(offsets)) * 0.6180339887498949) % 1.0)]
        self._all = self._left = len(offsets) * width * height
        for offset in offsets:
            y = 0
            while y < height:
                side, rows = self._side, min(self._side, height - y)
                for left, right, options in scene.panes(width):
                    for x in range(left, right, side):
                        part = (x, y, min(side, right - x), rows)
                        start = time.perf_counter()
                        self._add(renderer, scene, options, part, (float(offset[0]), float(offset[1])))
                        if time.perf_counter() - start < QUICK and part[2] == rows == side:
                            self._side = min(TILE, 2 * side)
                        self._left -= part[2] * part[3]
                        yield
                y += rows

    def _add(
        self, renderer: Renderer, scene: Scene, options: RenderOptions, part: Part, offset: tuple[float, float]
    ) -> None:
        gl = self._context.gl
        side = max(part[2:])
        if side > min(self._tile.size):
            self._tile = _resized(gl, self._tile, (side, side))
        renderer.prepare(scene.size, scene.camera, options, offset)
        renderer.draw(self._tile, part)
        _texture(self._tile).use(0)
        self._sample["corner"] = part[:2]
        self._fine.use()
        self._fine.viewport = part
        gl.enable(moderngl.BLEND)
        gl.blend_func = moderngl.ONE, moderngl.ONE
        self._sampling.render(moderngl.TRIANGLES, vertices=3)
        gl.disable(moderngl.BLEND)
        gl.finish()


def _buffer(gl: moderngl.Context, size: tuple[int, int]) -> moderngl.Framebuffer:
    texture = gl.texture(size, 4, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return gl.framebuffer([texture], gl.depth_renderbuffer(size))


def _resized(gl: moderngl.Context, buffer: moderngl.Framebuffer, size: tuple[int, int]) -> moderngl.Framebuffer:
    if buffer.size == size:
        return buffer
    free(buffer)
    return _buffer(gl, size)


def _texture(buffer: moderngl.Framebuffer) -> moderngl.Texture:
    texture = buffer.color_attachments[0]
    assert isinstance(texture, moderngl.Texture)
    return texture
