"""A mesh becomes the bytes of a PLY, OBJ, STL or GLB file, written by trimesh."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from ..model.orientation import DEFAULT_UP, as_in_file
from ..model.srgb import Values, to_linear
from .surface import Mesh

OPTIONS: dict[str, dict[str, Any]] = {
    ".ply": {"vertex_normal": True},
    ".obj": {"include_normals": True, "include_color": True},
    ".stl": {},
    ".glb": {"include_normals": True},
}
"""Suffix of a format that can be written -> options of trimesh's writer. An STL holds triangles alone."""


def check_suffix(path: Path) -> None:
    """Check that a file's name ends in a format that can be written. Raises UserError where it does not."""
    if path.suffix.lower() not in OPTIONS:
        raise UserError(f"{show(path)}: a mesh is written as {', '.join(OPTIONS)}")


def to_bytes(mesh: Mesh, suffix: str, centre: tuple[float, float, float], scale: float, up: str = DEFAULT_UP) -> bytes:
    """Return a mesh as a file, with its vertices in input space. centre, scale, up: those of a model (`Model.place`).

    suffix: a key of OPTIONS. Colours are written as sRGB, in a GLB as linear light, which is what glTF asks for.
    """
    written = as_trimesh(mesh, centre, scale, up, linear=suffix == ".glb")
    data = written.export(file_type=suffix[1:], **OPTIONS[suffix])
    return data.encode() if isinstance(data, str) else bytes(data)


def as_trimesh(
    mesh: Mesh, centre: tuple[float, float, float], scale: float, up: str = DEFAULT_UP, linear: bool = False
) -> trimesh.Trimesh:
    """Return a mesh as one of trimesh, with its vertices in input space. linear: with colours in linear light."""
    colours = None
    if mesh.colours is not None:
        colours = _bytes(to_linear(mesh.colours) if linear else mesh.colours)
    return trimesh.Trimesh(
        as_in_file(mesh.vertices.astype(np.float64) * scale + centre, up),
        mesh.faces,
        vertex_normals=None if mesh.normals is None else as_in_file(mesh.normals.astype(np.float64), up),
        vertex_colors=colours,
        process=False,
    )


def _bytes(colours: Values) -> NDArray[np.uint8]:
    """Convert colours in [0, 1] to whole numbers from 0 to 255."""
    return np.round(np.clip(colours, 0, 1) * 255).astype(np.uint8)
