"""A compiled program: its uniforms, their defaults, and its vertices."""

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl
import numpy as np

from ...codegen.targets.shader import NumberedText
from ...codegen.targets.uniforms import TIME, UNIFORMS
from .camera import Camera
from .compile import compile_program
from .tiles import Tile

UNITS = {"weights": 0, "cells": 1, "rays": 2, "points": 3, "normals": 4, "floor_light": 5}
"""Texture unit of each sampler in glsl/."""
OWN_UNIFORMS = (
    "plain",
    "split",
    "scattered",
    "newton",
    "floor_corner",
    "cell_count",
    "cells_half",
    "planes",
    "viewport",
)
"""Uniforms that single files of glsl/ declare."""
KNOWN = {uniform.name for uniform in (*UNIFORMS, TIME)}.union(UNITS, OWN_UNIFORMS)
"""Names that `Program.write` accepts."""


class Program:
    """A program in a context. Raises ShaderError if the driver rejects a shader."""

    defaults: dict[str, bytes]
    """Initial value of each uniform in use; a sampler's is its texture unit."""

    def __init__(
        self,
        gl: moderngl.Context,
        vertex: NumberedText,
        fragment: NumberedText,
        driver: str,
        content: Sequence[Any] = (),
        faces: moderngl.Buffer | None = None,
    ) -> None:
        """Compile the shaders.

        content, faces: vertex and index buffers, as in moderngl's vertex_array; without them, the vertex shader makes
        the vertices.
        """
        self.program = compile_program(gl, vertex, fragment, driver)
        members = {name: self.program[name] for name in self.program}
        self._uniforms = {name: member for name, member in members.items() if isinstance(member, moderngl.Uniform)}
        self.write(UNITS)
        self.defaults = {name: uniform.read() for name, uniform in self._uniforms.items()}
        self._vertices = gl.vertex_array(self.program, list(content), faces)

    def reset(self) -> None:
        """Give every uniform its default."""
        for name, default in self.defaults.items():
            self._uniforms[name].write(default)

    def write(self, values: Mapping[str, object]) -> None:
        """Write uniforms, name -> value, and skip uniforms that the program does not use.

        Drivers drop the unused end of an array; the numbers beyond it are skipped. Raises KeyError if no shader has a
        uniform of a name.
        """
        for name, value in values.items():
            if name not in KNOWN:
                raise KeyError(f"no shader has a uniform {name!r}")
            if (uniform := self._uniforms.get(name)) is not None:
                kind = np.float32 if uniform.mglo.fmt.endswith("f") else np.int32
                size = 4 * uniform.dimension * uniform.array_length
                uniform.write(np.ascontiguousarray(value, kind).tobytes()[:size])

    def draw(self, vertices: int = -1) -> None:
        """Draw the triangles of this many vertices; -1: of all in the buffers."""
        self._vertices.render(moderngl.TRIANGLES, vertices=vertices)

    def release(self) -> None:
        self._vertices.release()
        self.program.release()


def write_all(programs: Mapping[str, Program], values: Mapping[str, object]) -> None:
    """Write uniforms, name -> value, of all programs."""
    for program in programs.values():
        program.write(values)


def picture_uniforms(size: tuple[int, int], camera: Camera, jitter: tuple[float, float]) -> dict[str, object]:
    """Return the uniforms, name -> value, of one sample of a picture.

    size: (width, height) of the picture, pixels. jitter: offset of the sample from the pixel's center, pixels.
    """
    return {
        "resolution": (float(size[0]), float(size[1])),
        "camera": camera.matrix().T,  # GL reads column by column
        "focal": camera.focal,
        "jitter": jitter,
    }


def tile_uniforms(tile: Tile, corner: tuple[int, int]) -> dict[str, object]:
    """Return the uniforms, name -> value, of a tile whose lower left corner is the framebuffer's pixel `corner`."""
    x, y, width, height = tile
    return {
        "origin": (float(x - corner[0]), float(y - corner[1])),
        "viewport": (float(corner[0]), float(corner[1]), float(width), float(height)),
    }
