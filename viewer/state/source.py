"""What a window shows comes from a file: a model, or a shader that `bake --target glsl330` wrote."""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from ... import glsl
from ...codegen.targets.read_shader import read_shader
from ...codegen.targets.shader import Shader
from ...model.errors import UserError
from ...model.files import show
from ...model.mesh_file import SUFFIXES as SURFACES
from ...model.model import Model, load
from ..draw.compile import baked

SHADERS = (".glsl", ".frag", ".fs")
MESHES = (*SURFACES, ".xyz", ".npz")
"""Files that are trained first."""
CHECKPOINTS = (".pth",)
"""Files that are imported first, all levels of one shape: the smallest is level 1."""


@dataclass(frozen=True)
class Source:
    """name: of the model, printable. model: None for a shader file."""

    path: Path
    name: str
    shader: Shader
    model: Model | None
    textured: bool


def open_source(path: Path, storage: str = "auto") -> Source:
    """Reads a model or shader file. Raises UserError, one line that names the file."""
    if path.suffix.lower() not in SHADERS:
        model = load(path)
        return Source(path, show(model.name), baked(model, storage, "main.glsl"), model, model.texture is not None)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not text"
        raise UserError(f"cannot read {show(path)}: {reason}") from None
    try:
        shader, name = read_shader(text)
    except UserError as error:
        raise UserError(f"{show(path)}: {error}") from None
    return Source(path, show(name), shader, None, shader.textured)


class Watch:
    """Says when files change: `path`, a source's own, and the GLSL that a model is baked with."""

    def __init__(self, path: Path) -> None:
        self.path, self._paths = path, [path]
        if path.suffix.lower() not in SHADERS:
            self._paths += [Path(str(entry)) for entry in files(glsl).iterdir() if entry.name.endswith(".glsl")]
        self._seen = signatures(self._paths)

    def changed(self) -> bool:
        """Whether a file is another than at the last call."""
        now = signatures(self._paths)
        before, self._seen = self._seen, now
        return now != before


def signatures(paths: Iterable[Path]) -> list[tuple[int, int] | None]:
    """Time of change and length of each file; None where it is not there."""
    found: list[tuple[int, int] | None] = []
    for path in paths:
        try:
            facts = path.stat()
            found.append((facts.st_mtime_ns, facts.st_size))
        except OSError:
            found.append(None)
    return found
