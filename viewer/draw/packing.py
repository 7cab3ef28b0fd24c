"""On the CPU, packs the few rays that need tracing after Newton's step into full blocks of pixels.

Software GL computes squares of pixels at once, each as slow as its slowest ray; unpacked, many squares hold one ray.
"""

from collections.abc import Callable

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.shader import NEWTON_STEPS
from .adaptive import from_blocks, into_blocks
from .framebuffer import read_pixels, texture_of
from .program import UNITS
from .ray_buffers import RayBuffers
from .tiles import TILE_SIDE

Values = NDArray[np.float32]
DrawPass = Callable[[str, moderngl.Framebuffer, bool], None]
"""Draws the pass of a name into a framebuffer; the last argument is the uniform `newton` of gradient.glsl."""
SIDE = TILE_SIDE
"""Side of the framebuffers, pixels."""


class Packing:
    """The textures of packed rays, in the context `gl`."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._places = gl.texture((SIDE, SIDE), 2, dtype="f4")
        self._buffers = RayBuffers(gl, (SIDE, SIDE))
        self._buffers.rays.clear(depth=1.0)

    def trace(self, points: Values, states: Values, level: int, draw_pass: DrawPass) -> tuple[Values, Values]:
        """Trace `level` along the rays through points (N, 2) of the picture, N > 0.

        states: (N, 4), output of gradient.glsl for Newton's step. draw_pass: draws with `scattered` set, and with the
        depth test of other passes, since drivers would compile again for another. The context must be current; UNITS
        hold other textures afterwards. Returns the output of trace.glsl, (N, 4), and of gradient.glsl, (N, 4).
        """
        if len(points) > SIDE**2:  # a tile with its border
            halves = zip(np.array_split(points, 2), np.array_split(states, 2), strict=True)
            traced = [self.trace(*half, level, draw_pass) for half in halves]
            return np.concatenate([rays for rays, _ in traced]), np.concatenate([normals for _, normals in traced])
        buffers = self._buffers
        normals = self._draw("gradient", points, buffers.rays, states, draw_pass, newton=True).copy()
        rays = np.empty_like(normals)
        rays[:] = 0, NEWTON_STEPS, level, 1
        more = np.flatnonzero(normals[:, 3] < 0)
        if len(more):
            rays[more] = self._draw("trace", points[more], buffers.normals, normals[more], draw_pass)
            rays[more, 1] += 1
        hit = more[rays[more, 3] > 0.5]
        if len(hit):
            normals[hit] = self._draw("gradient", points[hit], buffers.rays, rays[hit], draw_pass)
        return rays, normals

    def release(self) -> None:
        self._places.release()
        self._buffers.release()

    def _draw(
        self,
        name: str,
        points: Values,
        source: moderngl.Framebuffer,
        states: Values,
        draw_pass: DrawPass,
        newton: bool = False,
    ) -> Values:
        """Write states (N, 4) to the framebuffer `source`, draw a pass into the other one, and return its output."""
        buffers = self._buffers
        target = buffers.normals if source is buffers.rays else buffers.rays
        packed = into_blocks(points, SIDE)
        height, width, _ = packed.shape
        region = 0, 0, width, height
        self._places.write(packed.tobytes(), region)
        self._places.use(UNITS["points"])
        texture_of(source).write(into_blocks(states, SIDE).tobytes(), region)
        buffers.use(region)
        draw_pass(name, target, newton)
        return from_blocks(read_pixels(target, (width, height)), len(points))
