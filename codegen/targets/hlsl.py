"""Target hlsl: the distance function alone, for Direct3D, Unity and Unreal, with its normal and colour."""

from ...model.model import Model
from ..printers.cstyle import Language
from .function_target import in_shader

LANGUAGE = Language(
    constant="static const {type} {name} = {value};",
    types={"vec3": "float3", "vec4": "float4", "mat4": "float4x4"},
    # A float4x4 is written row by row, a mat4 column by column: the same numbers are the transpose.
    product="mul({vector}, {matrix})",
    transposed="mul({matrix}, {vector})",
)


def standalone(
    model: Model, storage: str = "auto", digits: int | None = None, name: str | None = None, space: str = "model"
) -> str:
    """Return the functions of a model, whose names begin with `name` (None: made of the model's), in a space."""
    return in_shader(model, "hlsl", LANGUAGE, storage, digits, name, space)
