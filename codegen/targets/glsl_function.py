"""Target glsl: the distance function alone, for GLSL 3.30, GLSL ES 3.00 and Godot, with its normal and colour."""

from ...model.model import Model
from ..printers.cstyle import Language
from .function_target import in_shader

LANGUAGE = Language(by_columns=True)
"""The shading language of Godot makes a mat4 of its columns only."""


def standalone(
    model: Model, storage: str = "auto", digits: int | None = None, name: str | None = None, space: str = "model"
) -> str:
    """Return the functions of a model, whose names begin with `name` (None: made of the model's), in a space."""
    return in_shader(model, "glsl", LANGUAGE, storage, digits, name, space)
