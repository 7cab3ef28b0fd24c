"""Draws a frame in passes, one program after another; codegen/targets/shader.py says which."""

from collections.abc import Mapping
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.shader import FLOOR_BLOCK
from .framebuffer import free, set_color_mask, texture_of
from .packing import Packing
from .program import UNITS, Program
from .ray_buffers import RayBuffers
from .tiles import TILE_SIDE, Tile

ALWAYS, WHERE_NEAR = "1", "<="
"""Depth tests of a pass: it draws, and chooses where the next one does; it draws where the one before has said so."""


@dataclass(frozen=True, eq=False)
class Frame:
    """What a tile is drawn with, once its uniforms are set."""

    programs: Mapping[str, Program]
    """Of each pass, by name."""
    colours: tuple[str, ...]
    """Names of the last passes: that of the studio's floor, where there is one, and the one that colours."""
    level: int
    """The level that is traced."""
    looks_first: bool
    """Whether rays get a first look (glsl/normals.glsl)."""
    packs: bool
    """Whether the rays that it leaves are laid close together (packing.py)."""
    jitter: tuple[float, float]
    """Offset of samples from their pixels' centres, in pixels."""
    scattered: NDArray[np.float32] | None
    """(H, W, 2) where the tile's pixels lie in the picture; None where they are a tile of it."""

    def write(self, values: Mapping[str, object]) -> None:
        """Write uniforms of all programs."""
        for program in self.programs.values():
            program.write(values)

    def points(self, tile: Tile, chosen: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Return the points (N, 2) of the picture that the `chosen` pixels (H, W) of a tile are samples of."""
        if self.scattered is not None:
            return np.asarray(self.scattered[chosen])
        rows, columns = np.nonzero(chosen)
        corner = np.add(tile[:2], self.jitter) + 0.5
        return np.asarray(np.stack([columns, rows], axis=1) + corner, np.float32)


class Passes:
    """Holds what passes leave to one another, in the context of `gl`, and draws them."""

    places: moderngl.Texture
    """Where in the picture the pixels of a tile lie that are `scattered`."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        side = TILE_SIDE // 2  # of a power of two, as of RayBuffers; a tile with its border has fewer blocks
        self._floor = gl.framebuffer([gl.texture((side, side), 4, dtype="f4")])
        self.places = gl.texture((TILE_SIDE, TILE_SIDE), 2, dtype="f4")
        self._buffers: RayBuffers | None = None
        self._packing: Packing | None = None

    def draw(self, frame: Frame, target: moderngl.Framebuffer, tile: Tile, corner: tuple[int, int]) -> None:
        """Draw a tile into the `target`, RGBA32F with a depth buffer, which is bound and cleared."""
        gl, region = self._gl, (*corner, *tile[2:])
        if self._buffers is None or not self._buffers.holds(corner[0] + tile[2], corner[1] + tile[3]):
            if self._buffers is not None:
                self._buffers.release()
            self._buffers = RayBuffers(gl, target.size)
        buffers = self._buffers
        self._bind(region)
        gl.enable_only(moderngl.DEPTH_TEST)
        try:
            buffers.normals.clear(alpha=-1.0, viewport=region)  # and their depth
            self._draw(frame, "near", ALWAYS, buffers.rays)
            if frame.looks_first:
                self._draw(frame, "normals", WHERE_NEAR, buffers.normals, first=True)
            if frame.looks_first and frame.packs:
                self._trace_packed(frame, tile, region)
            else:
                if frame.looks_first:
                    self._draw(frame, "rest", ALWAYS, buffers.depth)
                self._draw(frame, "trace", WHERE_NEAR, buffers.rays)
                self._draw(frame, "rest", ALWAYS, buffers.depth)
                self._draw(frame, "normals", WHERE_NEAR, buffers.normals)
            if "floor" in frame.colours and frame.scattered is None:
                self._draw_floor(frame, tile)
            self._draw(frame, "behind", ALWAYS, target)
            self._draw(frame, frame.colours[-1], WHERE_NEAR, target)
        finally:
            gl.depth_func = "<"
            gl.enable_only(moderngl.NOTHING)
        set_color_mask(target, (False,) * 4)
        target.clear(depth=1.0, viewport=region)
        set_color_mask(target, (True,) * 4)

    def release(self) -> None:
        """Free the textures and framebuffers."""
        self.places.release()
        free(self._floor)
        for held in (self._buffers, self._packing):
            if held is not None:
                held.release()

    def _bind(self, region: Tile) -> None:
        """Bind the textures that passes read, and let drawing be into a region of the buffers."""
        assert self._buffers is not None
        self._buffers.use(region)
        # Always: software GL compiles shaders again where textures are not bound.
        self.places.use(UNITS["places"])
        texture_of(self._floor).use(UNITS["floor_light"])

    def _draw_floor(self, frame: Frame, tile: Tile) -> None:
        """Find what the floor sees at the corners of a tile's blocks of pixels."""
        x, y, width, height = tile
        left, below = x // FLOOR_BLOCK, y // FLOOR_BLOCK
        right, top = (x + width - 1) // FLOOR_BLOCK + 1, (y + height - 1) // FLOOR_BLOCK + 1
        self._floor.viewport = 0, 0, right + 1 - left, top + 1 - below
        frame.write({"floor_corner": (float(left), float(below))})
        self._draw(frame, "floor", ALWAYS, self._floor)

    def _trace_packed(self, frame: Frame, tile: Tile, region: Tile) -> None:
        """Trace the rays of a tile that the first look has left, close together."""
        assert self._buffers is not None
        rays, normals = (values.copy() for values in self._buffers.read(region))
        left = (rays[..., 3] > 0.5) & (normals[..., 3] < 0)
        if not left.any():
            return
        if self._packing is None:
            self._packing = Packing(self._gl)
        frame.write({"scattered": True})
        rays[left], normals[left] = self._packing.trace(
            frame.points(tile, left),
            normals[left],
            frame.level,
            lambda name, target, first: self._draw(frame, name, WHERE_NEAR, target, first=first),
        )
        frame.write({"scattered": frame.scattered is not None})
        self._buffers.write(region, rays, normals)
        self._bind(region)

    def _draw(self, frame: Frame, name: str, test: str, target: moderngl.Framebuffer, first: bool = False) -> None:
        """Draw a pass into a framebuffer. test: ALWAYS or WHERE_NEAR; first: uniform of normals.glsl."""
        target.use()
        self._gl.depth_func = test
        frame.programs[name].write({"first": first})
        frame.programs[name].draw(3)
