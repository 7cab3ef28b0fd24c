"""From a shader to a program and the texture of its weights; errors of the driver are placed in files and lines."""

import os
import re
from dataclasses import replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from ... import glsl
from ...codegen.targets.glsl330 import bake
from ...codegen.targets.shader import NumberedText, Shader
from ...model.errors import UserError
from ...model.interrupts import held_back
from ...model.model import Model

VERTEX_SHADER = """#version 330
void main() {  // one triangle that covers the picture
    gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}
"""
MIXED_PAYS = 100_000
"""Rays from which on it pays, on software OpenGL, to compile literals for what traces them, without optimising.

Both the compiling and what it saves grow with the parameters. For `spot`, in the processor's seconds:
2.8 more for compiling, which one core does, and 3.2 less for drawing 65,536 rays, which two do.
"""
LITERALS_PAY = 0.015
"""Rays, for the square of the number of parameters, from which on all is compiled to literals there, and optimised.

By the same measure: with the 21,893 parameters of `spot`, 60 more for compiling, 1.2 less for drawing 65,536 rays.
"""


class ShaderError(UserError):
    """The driver refuses a shader; the message has the first of its complaints."""

    log: list[str]
    """All complaints, with file and line."""

    def __init__(self, summary: str, log: list[str]) -> None:
        super().__init__(f"{summary}: {log[0]}")
        self.log = log


def bake_numbered(model: Model, storage: str, main: str) -> Shader:
    """Bake a model as glsl330.bake does, in such a way that `compile_program` places errors in the files of glsl/.

    main: name of the file in glsl/ that follows the field.
    """
    text, files = glsl.load_numbered(main)
    return replace(bake(model, storage, main=text), files=files)


def storage_for(storage: str, rays: int, parameters: int, software: bool) -> str:
    """Choose how a shader holds the weights that is compiled for one run: `storage`, where that is not "auto".

    rays: of all pictures. parameters: of the model. software: whether the CPU compiles and draws: literals draw
    three to five times as fast as a texture there, but compile for longer than a small picture takes.
    """
    if storage != "auto" or not software or not are_few(rays, parameters):
        return storage
    return "texture" if rays < MIXED_PAYS else "mixed"


def are_few(rays: int, parameters: int) -> bool:
    """Tell whether so many rays, of all pictures, take less time than optimising a program that draws them fast."""
    return rays < LITERALS_PAY * parameters**2


def compile_quickly() -> None:
    """Tell Mesa's software rasteriser not to optimise what it compiles, in this process, unless the user tells it more.

    It compiles in a quarter of the time then, and draws a fifth slower. Other drivers do not look at this variable, and
    Mesa does only before the first context is opened. Its cache of programs on disk tells both kinds apart.
    """
    os.environ.setdefault("GALLIVM_PERF", "nopt")


def compile_program(
    gl: moderngl.Context, vertex: NumberedText, fragment: NumberedText, driver: str
) -> moderngl.Program:
    """Compile and link a program. Raises ShaderError, which names the `driver`, where that refuses a shader."""
    try:
        with held_back():  # moderngl dies of an exception while it builds its program.
            return gl.program(vertex_shader=vertex[0], fragment_shader=fragment[0])
    except moderngl.Error as error:
        log = [line.strip() for line in str(error).splitlines() if line.strip()]
        complaints = [line for line in log if "error" in line.lower() and re.search(r"\d", line)] or log[-1:]
        shader = vertex if "vertex_shader" in log else fragment  # moderngl names the one that does not compile
        raise ShaderError(
            f"{driver} refuses the shader", [_placed(complaint[:300], *shader) for complaint in complaints]
        ) from None


def weight_texture(gl: moderngl.Context, weights: NDArray[np.float32]) -> moderngl.Texture:
    """Make the RGBA32F texture of weights (H, W, 4). Raises UserError where the driver's textures are too small."""
    height, width, _ = weights.shape
    largest = int(gl.info["GL_MAX_TEXTURE_SIZE"])
    if max(height, width) > largest:
        raise UserError(f"the weights need a texture of {width}x{height}; this driver's largest is {largest}")
    texture = gl.texture((width, height), 4, np.ascontiguousarray(weights, np.float32).tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def cell_texture(gl: moderngl.Context, sizes: NDArray[np.uint8]) -> moderngl.Texture3D:
    """Make the R8UI texture of a grid of Cells, (N, N, N)."""
    texture = gl.texture3d(sizes.shape[::-1], 1, np.ascontiguousarray(sizes).tobytes(), alignment=1, dtype="u1")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def _placed(complaint: str, text: str, files: tuple[str, ...]) -> str:
    """Return a line of the driver's log with the file's name and the source line in place of `source:line`.

    text, files: the shader's (NumberedText). Drivers write a place as 0:17, 0(17) or 0:17(5); a complaint without a
    place in the shader comes back as it is.
    """
    place = re.search(r"\d+[:(](\d+)\)?(?:\(\d+\))?", complaint)
    if place is None:
        return complaint
    file, number = divmod(int(place[1]), glsl.FILE)
    name = files[file - 1] if 1 <= file <= len(files) else ""
    lines = (glsl.read(name) if name else text).splitlines()
    if not 1 <= number <= len(lines):
        return complaint
    where = f"{name}:{number}" if name else f"line {number}"
    return f"{complaint[: place.start()]}{where}{complaint[place.end() :]}; {lines[number - 1].strip()[:120]}"
