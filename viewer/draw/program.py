"""A compiled program with its uniforms, each of which has a default, and the vertices that it draws."""

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl

from ...codegen.targets.shader import NumberedText
from .compile import compile_program
from .uniforms import write_uniform

UNITS = {"weights": 0, "cells": 1, "rays": 2, "places": 3, "normals": 4, "floor_light": 5}
"""The texture unit of each sampler of the shaders in glsl/."""


class Program:
    """One program in a context; `draw` draws its vertices. Raises ShaderError where the driver refuses a shader."""

    defaults: dict[str, bytes]
    """What the shader initialises each uniform with, a sampler with its texture unit; those out of use are left out."""

    def __init__(self, gl: moderngl.Context, vertex: NumberedText, fragment: NumberedText, driver: str) -> None:
        self._gl = gl
        self.program = compile_program(gl, vertex, fragment, driver)
        self.write(UNITS)
        members = {name: self.program[name] for name in self.program}
        self._uniforms = {name: member for name, member in members.items() if isinstance(member, moderngl.Uniform)}
        self.defaults = {name: uniform.read() for name, uniform in self._uniforms.items()}
        self._vertices: moderngl.VertexArray | None = None

    def take(self, content: Sequence[Any] = (), faces: moderngl.Buffer | None = None) -> None:
        """Take the vertices to draw, as Context.vertex_array does; without any, the shader makes them."""
        self._vertices = self._gl.vertex_array(self.program, list(content), faces)

    def reset(self) -> None:
        """Give every uniform its default."""
        for name, default in self.defaults.items():
            self._uniforms[name].write(default)

    def write(self, values: Mapping[str, object]) -> None:
        """Write uniforms, name -> value; those that the program lacks are skipped."""
        for name, value in values.items():
            write_uniform(self.program, name, value)

    def draw(self, vertices: int = -1) -> None:
        """Draw the triangles of so many vertices; -1: of all that `take` was given."""
        assert self._vertices is not None
        self._vertices.render(moderngl.TRIANGLES, vertices=vertices)

    def release(self) -> None:
        """Free what is held in the context, but for buffers."""
        if self._vertices is not None:
            self._vertices.release()
        self.program.release()
