"""The uniforms that place a picture and its tiles, and how values are written to the uniforms of a program."""

import moderngl
import numpy as np

from ...codegen.targets.uniforms import UNIFORMS
from .camera import Camera
from .tiles import Tile

INTEGERS = {uniform.name for uniform in UNIFORMS if uniform.type == "int"} | {
    "plain",
    "scattered",
    "cells",
    "cell_count",
    "places",
    "rays",
    "normals",
    "floor_light",
    "first",
    "weights",
}
"""Names of the uniforms whose values are written as 32-bit integers; `plain`, `scattered` and `first` are bools."""


def picture_uniforms(size: tuple[int, int], camera: Camera, jitter: tuple[float, float]) -> dict[str, object]:
    """Return name -> value of the uniforms that say which sample of which picture is drawn.

    size: (width, height) of the picture, in pixels. jitter: offset of the sample from the pixel's centre, in pixels.
    """
    return {
        "resolution": (float(size[0]), float(size[1])),
        "camera": camera.matrix().T,  # GL reads column by column
        "focal": camera.focal,
        "jitter": jitter,
    }


def tile_uniforms(tile: Tile, corner: tuple[int, int]) -> dict[str, object]:
    """Return name -> value of the uniforms that say which tile is drawn, and where in the framebuffer.

    corner: the pixel of the framebuffer that the tile's lower left corner falls on.
    """
    x, y, width, height = tile
    return {
        "origin": (float(x - corner[0]), float(y - corner[1])),
        "viewport": (float(corner[0]), float(corner[1]), float(width), float(height)),
    }


def write_uniform(program: moderngl.Program, name: str, value: object) -> None:
    """Write numbers to the uniform of this name.

    A uniform that the program lacks is skipped: drivers leave out what a shader makes no use of. For the same reason
    an array may be shorter than its declaration: the numbers beyond its end are left out.
    """
    if name not in program:
        return
    uniform = program[name]
    assert isinstance(uniform, moderngl.Uniform)
    dtype = np.int32 if name in INTEGERS else np.float32
    size = 4 * uniform.dimension * uniform.array_length
    uniform.write(np.ascontiguousarray(value, dtype).tobytes()[:size])
