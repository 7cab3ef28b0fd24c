"""A shader -> a program and the texture of its weights; where the driver refuses, its log with files and lines."""

import re
from dataclasses import replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from ... import glsl
from ...codegen.targets.glsl330 import bake
from ...codegen.targets.shader import Shader
from ...model.errors import UserError
from ...model.model import Model

Numbered = tuple[str, tuple[str, ...]]
"""A shader's text, and the names of the files in glsl/ that its `#line` directives tell apart (glsl.load_numbered)."""
VERTEX_SHADER = """#version 330
void main() {  // one triangle that covers the picture
    gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}
"""


class ShaderError(UserError):
    """The driver does not take a shader. log: its complaints, with file and line."""

    def __init__(self, what: str, log: list[str]) -> None:
        super().__init__(f"{what}: {log[0]}")
        self.log = log


def baked(model: Model, storage: str, main: str) -> Shader:
    """glsl330.bake, of a file in glsl/, such that `compiled` places errors in the files there."""
    text, files = glsl.load_numbered(main)
    return replace(bake(model, storage, main=text), files=files)


def compiled(gl: moderngl.Context, vertex: Numbered, fragment: Numbered, driver: str) -> moderngl.Program:
    """Raises ShaderError. driver: what it calls itself."""
    try:
        return gl.program(vertex_shader=vertex[0], fragment_shader=fragment[0])
    except moderngl.Error as error:
        log = [line.strip() for line in str(error).splitlines() if line.strip()]
        found = [line for line in log if "error" in line.lower() and re.search(r"\d", line)] or log[-1:]
        shader = vertex if "vertex_shader" in log else fragment  # moderngl names the one that does not compile
        raise ShaderError(f"{driver} refuses the shader", [_placed(line[:300], *shader) for line in found]) from None


def weight_texture(gl: moderngl.Context, weights: NDArray[np.float32]) -> moderngl.Texture:
    """Weights (H, W, 4), RGBA32F. Raises UserError where the driver's textures are too small."""
    height, width, _ = weights.shape
    largest = int(gl.info["GL_MAX_TEXTURE_SIZE"])
    if max(height, width) > largest:
        raise UserError(f"the weights need a texture of {width}x{height}; this driver's largest is {largest}")
    texture = gl.texture((width, height), 4, np.ascontiguousarray(weights, np.float32).tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def _placed(line: str, text: str, files: tuple[str, ...]) -> str:
    """A line of the driver's log with the file's name and the line itself, where it says `source:line` or so."""
    place = re.search(r"\d+[:(](\d+)\)?(?:\(\d+\))?", line)
    if place is None:
        return line
    file, number = divmod(int(place[1]), glsl.FILE)
    name = files[file - 1] if 1 <= file <= len(files) else ""
    lines = (glsl.read(name) if name else text).splitlines()
    if not 1 <= number <= len(lines):
        return line
    where = f"{name}:{number}" if name else f"line {number}"
    return f"{line[: place.start()]}{where}{line[place.end() :]}; {lines[number - 1].strip()[:120]}"
