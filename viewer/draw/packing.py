"""Traces the rays that a tile has left after a first look, laid close together, where the CPU draws.

Drivers that draw on the CPU compute squares of pixels at once, and a square takes as long as its slowest ray. Few rays
are left, but many squares hold one of them.
"""

from collections.abc import Callable

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.shader import FIRST_LOOKS
from .adaptive import from_blocks, into_blocks
from .framebuffer import read_pixels, texture_of
from .program import UNITS
from .ray_buffers import RayBuffers
from .tiles import TILE_SIDE

Values = NDArray[np.float32]
DrawPass = Callable[[str, moderngl.Framebuffer, bool], None]
"""Draws a pass, by its name, into a framebuffer; the last argument is the uniform `first` of normals.glsl."""
SIDE = TILE_SIDE
"""Pixels along a side of the framebuffers."""


class Packing:
    """Holds the textures in which rays lie close together, in the context of `gl`."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._places = gl.texture((SIDE, SIDE), 2, dtype="f4")
        self._buffers = RayBuffers(gl, (SIDE, SIDE))
        self._buffers.rays.clear(depth=1.0)

    def trace(self, points: Values, left: Values, level: int, draw_pass: DrawPass) -> tuple[Values, Values]:
        """Trace `level` along rays through points (N, 2) of the picture, which a first look left as (N, 4) says, N > 0.

        draw_pass draws with `scattered` set, where the depth is 1 (with the test that passes have elsewhere, or drivers
        would compile them again). The context must be current; UNITS have other textures afterwards.
        Returns what trace.glsl gives, (N, 4), and what normals.glsl gives for those that have hit, (N, 4).
        """
        if len(points) > SIDE**2:  # of a tile with its border
            halves = zip(np.array_split(points, 2), np.array_split(left, 2), strict=True)
            traced = [self.trace(*half, level, draw_pass) for half in halves]
            return np.concatenate([rays for rays, _ in traced]), np.concatenate([normals for _, normals in traced])
        normals = self._normals(points, left, draw_pass, first=True).copy()
        rays = np.empty_like(normals)
        rays[:] = 0, FIRST_LOOKS, level, 1
        more = np.flatnonzero(normals[:, 3] < 0)
        if len(more):
            rays[more] = self._draw("trace", points[more], self._buffers.normals, normals[more], draw_pass)
            rays[more, 1] += 1
        hit = more[rays[more, 3] > 0.5]
        if len(hit):
            normals[hit] = self._normals(points[hit], rays[hit], draw_pass, first=False)
        return rays, normals

    def release(self) -> None:
        """Free the textures."""
        self._places.release()
        self._buffers.release()

    def _normals(self, points: Values, given: Values, draw_pass: DrawPass, *, first: bool) -> Values:
        """Draw the pass of this name for rays, and return what it draws. given: what it finds in `rays`, (N, 4)."""
        return self._draw("normals", points, self._buffers.rays, given, draw_pass, first)

    def _draw(
        self,
        name: str,
        points: Values,
        source: moderngl.Framebuffer,
        given: Values,
        draw_pass: DrawPass,
        first: bool = False,
    ) -> Values:
        """Draw a pass for rays into that of the two framebuffers which it does not read, and return what it draws.

        source: the framebuffer whose texture it reads; given: what it is to find there, (N, 4).
        """
        buffers = self._buffers
        target = buffers.normals if source is buffers.rays else buffers.rays
        placed = into_blocks(points, SIDE)
        height, width, _ = placed.shape
        region = 0, 0, width, height
        self._places.write(placed.tobytes(), region)
        self._places.use(UNITS["places"])
        texture_of(source).write(into_blocks(given, SIDE).tobytes(), region)
        buffers.use(region)
        draw_pass(name, target, first)
        return from_blocks(read_pixels(target, (width, height)), len(points))
