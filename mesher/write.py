"""Conversion of a mesh to a PLY, OBJ, STL or GLB file, by trimesh."""

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
"""Suffix of an output format -> options of trimesh's writer. STL holds triangles alone."""


def check_suffix(path: Path) -> None:
    """Raise UserError if the suffix of a file is no output format."""
    if path.suffix.lower() not in OPTIONS:
        raise UserError(f"{show(path)}: a mesh is written as {', '.join(OPTIONS)}")


def to_bytes(mesh: Mesh, suffix: str, center: tuple[float, float, float], scale: float, up: str = DEFAULT_UP) -> bytes:
    """Convert a mesh to the bytes of a file, with vertices in input space. center, scale, up: `Model.place`.

    suffix: a key of OPTIONS. Colors are sRGB, but linear in a GLB, as glTF prescribes.
    """
    written = as_trimesh(mesh, center, scale, up, linear=suffix == ".glb")
    data = written.export(file_type=suffix[1:], **OPTIONS[suffix])
    return data.encode() if isinstance(data, str) else bytes(data)


def as_trimesh(
    mesh: Mesh, center: tuple[float, float, float], scale: float, up: str = DEFAULT_UP, linear: bool = False
) -> trimesh.Trimesh:
    """Convert a mesh to trimesh, with vertices in input space. linear: colors in linear light."""
    colors = None
    if mesh.colors is not None:
        colors = _bytes(to_linear(mesh.colors) if linear else mesh.colors)
    return trimesh.Trimesh(
        as_in_file(mesh.vertices.astype(np.float64) * scale + center, up),
        mesh.faces,
        vertex_normals=None if mesh.normals is None else as_in_file(mesh.normals.astype(np.float64), up),
        vertex_colors=colors,
        process=False,
    )


def _bytes(colors: Values) -> NDArray[np.uint8]:
    """Convert colors in [0, 1] to bytes."""
    return np.round(np.clip(colors, 0, 1) * 255).astype(np.uint8)
