"""Draws a frame in passes, one program each; in the order of FRAME (codegen/targets/shader.py)."""

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.shader import FLOOR_BLOCK, FRAME, MASKED
from .framebuffer import free, set_color_mask, texture_of
from .packing import Packing
from .program import UNITS, Program, write_all
from .ray_buffers import RayBuffers
from .tiles import TILE_SIDE, Tile

ALWAYS, WHERE_SET = "1", "<="
"""Depth tests; the depth buffer is the mask. ALWAYS: draw, and write the mask. WHERE_SET: draw only where it is 1."""


class Passes:
    """Draws the passes in the context `gl`, and owns the textures between them."""

    color = "color"
    """The pass of the step "color": "color" or "softbox"."""
    level = 1
    """Level to trace."""
    newton_first = False
    """Whether rays take Newton's step before they are traced (glsl/passes/gradient.glsl)."""
    jitter: tuple[float, float] = (0.0, 0.0)
    """Offset of the samples from the pixel centers, pixels."""
    scattered: NDArray[np.float32] | None = None
    """Points (H, W, 2) of the picture that the pixels sample; None: the pixels form a tile of it."""
    places: moderngl.Texture
    """The `scattered` points."""

    def __init__(self, gl: moderngl.Context, programs: dict[str, Program], packs: bool) -> None:
        """programs: of each pass, by name. packs: trace the rays that Newton's step leaves as packing.py does."""
        self._gl, self._programs, self._packs = gl, programs, packs
        side = TILE_SIDE // 2  # a power of two, as in RayBuffers, and at least the number of blocks in a tile
        self._floor = gl.framebuffer([gl.texture((side, side), 4, dtype="f4")])
        self.places = gl.texture((TILE_SIDE, TILE_SIDE), 2, dtype="f4")
        self._buffers: RayBuffers | None = None
        self._packing: Packing | None = None

    def draw(self, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int]) -> None:
        """Draw a tile into the `target`, RGBA32F with a depth buffer, which is bound and cleared."""
        gl, region, buffers = self._gl, (*corner, *tile[2:]), self._buffers
        if buffers is None or np.less(buffers.rays.size, np.add(corner, tile[2:])).any():
            if buffers is not None:
                buffers.release()
            self._buffers = buffers = RayBuffers(gl, target.size)
        self._bind(buffers, region)
        write_all(self._programs, {"scattered": self.scattered is not None})
        gl.enable_only(moderngl.DEPTH_TEST)
        try:
            buffers.normals.clear(alpha=-1.0, viewport=region)  # clears the depth, too
            for step in self._steps():
                if step == "floor":
                    self._draw_floor(tile)
                elif step == "trace" and self._packs_now:
                    self._trace_packed(buffers, tile, region)
                else:
                    name = FRAME[step]
                    test, output = WHERE_SET if name in MASKED else ALWAYS, buffers.outputs.get(name, target)
                    self._draw(self.color if step == "color" else name, test, output, newton=step == "newton")
        finally:
            gl.depth_func = "<"
            gl.enable_only(moderngl.NOTHING)
        set_color_mask(target, (False,) * 4)
        target.clear(depth=1.0, viewport=region)
        set_color_mask(target, (True,) * 4)

    def release(self) -> None:
        self.places.release()
        free(self._floor)
        for resource in (self._buffers, self._packing):
            if resource is not None:
                resource.release()

    @property
    def _packs_now(self) -> bool:
        return self._packs and self.newton_first

    def _steps(self) -> list[str]:
        """Return the steps of FRAME that the options need. Packed rays take several steps in "trace"."""
        left_out = set() if self.newton_first else {"newton", "untraced"}
        if self._packs_now:
            left_out |= {"untraced", "hits", "normals"}
        if self.color != "softbox" or self.scattered is not None:
            left_out.add("floor")
        return [step for step in FRAME if step not in left_out]

    def _bind(self, buffers: RayBuffers, region: Tile) -> None:
        """Bind the textures that passes read, and restrict drawing to a region of the buffers."""
        buffers.use(region)
        # Always: software GL compiles shaders again if a texture is not bound.
        self.places.use(UNITS["points"])
        texture_of(self._floor).use(UNITS["floor_light"])

    def _draw_floor(self, tile: Tile) -> None:
        """Compute the floor's light at the corners of a tile's blocks of pixels, and of the blocks around them."""
        x, y, width, height = tile
        left, bottom = x // FLOOR_BLOCK - 1, y // FLOOR_BLOCK - 1
        right, top = (x + width - 1) // FLOOR_BLOCK + 2, (y + height - 1) // FLOOR_BLOCK + 2
        self._floor.viewport = 0, 0, right + 1 - left, top + 1 - bottom
        write_all(self._programs, {"floor_corner": (float(left), float(bottom))})
        self._draw("floor", ALWAYS, self._floor)

    def _trace_packed(self, buffers: RayBuffers, tile: Tile, region: Tile) -> None:
        """Pack and trace the rays of a tile that Newton's step has not finished."""
        rays, normals = (values.copy() for values in buffers.read(region))
        unfinished = (rays[..., 3] > 0.5) & (normals[..., 3] < 0)
        if not unfinished.any():
            return
        self._packing = self._packing or Packing(self._gl)
        write_all(self._programs, {"scattered": True})
        rays[unfinished], normals[unfinished] = self._packing.trace(
            self._points(tile, unfinished),
            normals[unfinished],
            self.level,
            lambda name, target, newton: self._draw(name, WHERE_SET, target, newton=newton),
        )
        write_all(self._programs, {"scattered": self.scattered is not None})
        buffers.write(region, rays, normals)
        self._bind(buffers, region)

    def _points(self, tile: Tile, chosen: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Return the points (N, 2) of the picture that the `chosen` pixels (H, W) of a tile sample."""
        if self.scattered is not None:
            return np.asarray(self.scattered[chosen])
        rows, columns = np.nonzero(chosen)
        corner = np.add(tile[:2], self.jitter) + 0.5
        return np.asarray(np.stack([columns, rows], axis=1) + corner, np.float32)

    def _draw(self, name: str, test: str, target: moderngl.Framebuffer, newton: bool = False) -> None:
        """Draw a pass into a framebuffer. test: ALWAYS or WHERE_SET; newton: uniform of gradient.glsl."""
        target.use()
        self._gl.depth_func = test
        self._programs[name].write({"newton": newton})
        self._programs[name].draw(3)
