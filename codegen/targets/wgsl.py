"""Target wgsl: the distance function alone, for WebGPU, with its normal and colour."""

from ...model.model import Model
from ..printers.cstyle import Language
from .function_target import in_shader

LANGUAGE = Language(
    constant="const {name} = {value};",
    function="fn {name}({parameters}) -> {type}",
    types={"float": "f32", "int": "i32", "vec3": "vec3f", "vec4": "vec4f", "mat4": "mat4x4f"},
    parameter="{name}: {type}",
    variable="var {name}: {type} = {value};",
    pick="select({no}, {yes}, {condition})",
)


def standalone(
    model: Model, storage: str = "auto", digits: int | None = None, name: str | None = None, space: str = "model"
) -> str:
    """Return the functions of a model, whose names begin with `name` (None: made of the model's), in a space."""
    return in_shader(model, "wgsl", LANGUAGE, storage, digits, name, space)
