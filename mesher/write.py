"""A mesh as the bytes of a PLY, OBJ, STL or GLB file, by trimesh."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from .surface import Array, Mesh

OPTIONS: dict[str, dict[str, Any]] = {
    ".ply": {"vertex_normal": True},
    ".obj": {"include_normals": True, "include_color": True},
    ".stl": {},
    ".glb": {"include_normals": True},
}
"""Suffix -> what trimesh's writer of it is told. An STL holds triangles alone."""


def check_suffix(path: Path) -> None:
    """Raises UserError where the name does not end in a format that can be written."""
    if path.suffix.lower() not in OPTIONS:
        raise UserError(f"{show(path)}: a mesh is written as {', '.join(OPTIONS)}")


def to_bytes(mesh: Mesh, suffix: str, centre: tuple[float, float, float], scale: float) -> bytes:
    """The file; its vertices are in input space = model space * scale + centre.

    Colours are sRGB, in a GLB linear, as glTF has them.
    """
    colours = None
    if mesh.colours is not None:
        colours = _bytes(_linear(mesh.colours) if suffix == ".glb" else mesh.colours)
    written = trimesh.Trimesh(
        mesh.vertices.astype(np.float64) * scale + centre,
        mesh.faces,
        vertex_normals=mesh.normals,
        vertex_colors=colours,
        process=False,
    )
    data = written.export(file_type=suffix[1:], **OPTIONS[suffix])
    return data.encode() if isinstance(data, str) else bytes(data)


def _linear(colours: Array) -> Array:
    """sRGB -> linear, IEC 61966-2-1."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _bytes(colours: Array) -> NDArray[np.uint8]:
    return np.round(np.clip(colours, 0, 1) * 255).astype(np.uint8)
