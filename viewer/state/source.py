"""The file that a window shows: a model, or a shader from `bake --target glsl330`."""

from dataclasses import dataclass
from pathlib import Path

from ...codegen.targets.glsl330 import bake
from ...codegen.targets.read_shader import read_shader
from ...codegen.targets.shader import Shader
from ...model.endings import SHAPES
from ...model.errors import UserError
from ...model.files import regular, show
from ...model.model import Model
from ...model.model_file import load

SHADER_SUFFIXES = (".glsl", ".frag", ".fs")
"""Suffixes of baked shaders; a file with any other suffix is read as a model."""
TRAINED_SUFFIXES = tuple(SHAPES)
"""Suffixes of shapes that a model can be trained on."""
CHECKPOINT_SUFFIXES = (".pth",)
"""Suffixes of checkpoints, which are imported together, one per level."""


@dataclass(frozen=True)
class Source:
    """A file, and the shader that draws it."""

    path: Path
    name: str
    """The model's name, printable."""
    shader: Shader
    model: Model | None
    """None for a shader file."""
    textured: bool
    """Whether the model has its own colors."""
    front: tuple[float, float] | None
    """Azimuth and elevation of the first view, degrees; None if the file has none."""


def open_source(path: Path, storage: str = "auto") -> Source:
    """Read a shader file, or a model file, and bake its shader. storage: of the weights.

    Raises UserError, one line that names the file.
    """
    if path.suffix.lower() not in SHADER_SUFFIXES:
        model = load(path)
        shader = bake(model, storage, passes=True)
        return Source(path, show(model.name), shader, model, model.colored, model.front)
    try:
        shader, name, front = read_shader(regular(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not text"
        raise UserError(f"cannot read {show(path)}: {reason}") from None
    except UserError as error:
        raise UserError(f"{show(path)}: {error}") from None
    return Source(path, show(name), shader, None, shader.textured, front)
