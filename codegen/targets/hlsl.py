"""Target hlsl: the distance function for Direct3D, Unity and Unreal, with its normal and color."""

from ..printers.cstyle import Language
from .function_target import shader_target

LANGUAGE = Language(
    constant="static const {type} {name} = {value};",
    types={"vec3": "float3", "vec4": "float4", "mat4": "float4x4"},
    # A float4x4 is written row by row, a mat4 column by column: the same numbers are the transpose.
    product="mul({vector}, {matrix})",
    transposed="mul({matrix}, {vector})",
)
standalone = shader_target("hlsl", LANGUAGE)
