"""Compiles shaders, uploads weights as textures, and maps the driver's errors to files and lines."""

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
MIXED_RAYS = 100_000
"""On software GL, compile the tracing weights as literals, unoptimized, from this many rays on.

For `spot`: 2.8 s of processor time more to compile, 3.2 s less to draw 65,536 rays.
"""
LITERAL_RAYS = 0.015
"""On software GL, compile weights as literals above this many rays per squared parameter count.

For `spot`, 21,893 parameters: 60 s of processor time more to compile, 1.2 s less to draw 65,536 rays.
"""


class ShaderError(UserError):
    """The driver rejects a shader; the message has the first complaint."""

    log: list[str]
    """All complaints, with file and line."""

    def __init__(self, summary: str, log: list[str]) -> None:
        super().__init__(f"{summary}: {log[0]}")
        self.log = log


def bake_numbered(model: Model, storage: str, main: str) -> Shader:
    """Bake the file `main` of glsl/, which traces no rays, with #line directives for `compile_program`."""
    text, files = glsl.load_numbered(main)
    return replace(bake(model, storage, main=text, traces=False), files=files)


def storage_for(storage: str, rays: int, parameters: int, software: bool) -> str:
    """Resolve the storage "auto" for software GL, where literals draw 3 to 5 times faster but compile for long.

    rays: of all pictures. parameters: of the model. software: whether the CPU compiles and draws.
    """
    if storage != "auto" or not software or not compiling_dominates(rays, parameters):
        return storage
    return "texture" if rays < MIXED_RAYS else "mixed"


def compiling_dominates(rays: int, parameters: int) -> bool:
    """Whether drawing these rays takes less time than compiling weights as optimized literals."""
    return rays < LITERAL_RAYS * parameters**2


def compile_quickly() -> None:
    """Let Mesa's software rasterizer skip optimization: it compiles 4 times faster and draws a fifth slower.

    Mesa reads the variable when the first context opens. A value that the user has set stays.
    """
    os.environ.setdefault("GALLIVM_PERF", "nopt")


def compile_program(
    gl: moderngl.Context, vertex: NumberedText, fragment: NumberedText, driver: str
) -> moderngl.Program:
    """Compile and link a program. Raises ShaderError, which names the `driver`."""
    try:
        with held_back():  # an exception during gl.program would crash moderngl
            return gl.program(vertex_shader=vertex[0], fragment_shader=fragment[0])
    except moderngl.Error as error:
        log = [line.strip() for line in str(error).splitlines() if line.strip()]
        complaints = [line for line in log if "error" in line.lower() and re.search(r"\d", line)] or log[-1:]
        shader = vertex if "vertex_shader" in log else fragment  # moderngl names the shader that fails
        raise ShaderError(
            f"{driver} refuses the shader", [_with_place(complaint[:300], *shader) for complaint in complaints]
        ) from None


def weight_texture(gl: moderngl.Context, weights: NDArray[np.float32]) -> moderngl.Texture:
    """Upload weights (H, W, 4) as RGBA32F. Raises UserError if they exceed the driver's largest texture."""
    height, width, _ = weights.shape
    largest = int(gl.info["GL_MAX_TEXTURE_SIZE"])
    if max(height, width) > largest:
        raise UserError(f"the weights need a texture of {width}x{height}; this driver's largest is {largest}")
    texture = gl.texture((width, height), 4, np.ascontiguousarray(weights, np.float32).tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def cell_texture(gl: moderngl.Context, grid: NDArray[np.uint8]) -> moderngl.Texture3D:
    """Upload a grid (N, N, N) of Cells as R8UI."""
    texture = gl.texture3d(grid.shape[::-1], 1, np.ascontiguousarray(grid).tobytes(), alignment=1, dtype="u1")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def _with_place(complaint: str, text: str, files: tuple[str, ...]) -> str:
    """Replace `source:line` in a complaint of the driver by the file's name, and append the source line.

    text, files: of the shader (NumberedText). Drivers write the place as 0:17, 0(17) or 0:17(5).
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
