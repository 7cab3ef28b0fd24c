"""Target glsl: the distance function for GLSL 3.30, GLSL ES 3.00 and Godot, with its normal and color."""

from ..printers.cstyle import Language
from .function_target import shader_target

# Godot's shading language makes a mat4 only of its columns.
standalone = shader_target("glsl", Language(by_columns=True))
