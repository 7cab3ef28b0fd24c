"""Target wgsl: the distance function for WebGPU, with its normal and color."""

from ..printers.cstyle import Language
from .function_target import shader_target

LANGUAGE = Language(
    constant="const {name} = {value};",
    function="fn {name}({parameters}) -> {type}",
    types={"float": "f32", "int": "i32", "vec3": "vec3f", "vec4": "vec4f", "mat4": "mat4x4f"},
    parameter="{name}: {type}",
    variable="var {name}: {type} = {value};",
    pick="select({no}, {yes}, {condition})",
    out="{name}: ptr<function, {type}>",
    assign="*{name} = {value};",
    loop="for (var i = 0; i < {count}; i++) {{",
)
standalone = shader_target("wgsl", LANGUAGE)
