"""The file behind what a window shows: a model, or a shader that `bake --target glsl330` wrote."""

from dataclasses import dataclass
from pathlib import Path

from ...codegen.targets.glsl330 import bake
from ...codegen.targets.read_shader import read_shader
from ...codegen.targets.shader import Shader
from ...model.checks import SHAPES
from ...model.errors import UserError
from ...model.files import show
from ...model.model import Model
from ...model.model_file import load

SHADER_SUFFIXES = (".glsl", ".frag", ".fs")
"""Endings of baked shaders; a file with any other ending is read as a model."""
TRAINED_SUFFIXES = tuple(SHAPES)
"""Endings of shapes, from which a model is trained before it can be shown."""
CHECKPOINT_SUFFIXES = (".pth",)
"""Endings of checkpoints, which are imported before they can be shown, all levels of one shape at once."""


@dataclass(frozen=True)
class Source:
    """A file that was read, and the shader that draws it."""

    path: Path
    """Where it was read."""
    name: str
    """The model's name, with nothing in it that a terminal would not print."""
    shader: Shader
    """The one in the file, or the one that was baked from the model."""
    model: Model | None
    """None if the file is a shader."""
    textured: bool
    """Whether the model has colours of its own."""
    front: tuple[float, float] | None
    """Azimuth and elevation, in degrees, of the first view; None where the file names none."""


def open_source(path: Path, storage: str = "auto") -> Source:
    """Read a model file, whose shader is baked with `storage` for its weights, or a shader file.

    Raises UserError, one line that names the file, if it cannot be read or is neither.
    """
    if path.suffix.lower() not in SHADER_SUFFIXES:
        model = load(path)
        shader = bake(model, storage, passes=True)
        return Source(path, show(model.name), shader, model, model.coloured, model.front)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not text"
        raise UserError(f"cannot read {show(path)}: {reason}") from None
    try:
        shader, name, front = read_shader(text)
    except UserError as error:
        raise UserError(f"{show(path)}: {error}") from None
    return Source(path, show(name), shader, None, shader.textured, front)
