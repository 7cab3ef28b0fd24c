"""Triangle meshes from files, read by trimesh (extra `mesh`) and checked."""

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .errors import UserError
from .files import show
from .strips import mesh_of_strips

if TYPE_CHECKING:
    import trimesh

SUFFIXES = (".ply", ".obj", ".stl", ".glb")
"""Suffixes of mesh files, in lower case."""
LARGEST = 1e30
"""Largest coordinate of a vertex: its powers are still finite."""

LONGEST_HEADER = 65_536
"""Largest length in bytes of the header of a PLY."""


def load_mesh(path: Path, why: str = "") -> "trimesh.Trimesh":
    """Read the triangles of a PLY, OBJ, STL or GLB file unchanged, with the normals of a PLY or OBJ.

    why: appended to the message about a file without triangles, for example "; ... needs a surface". Raises UserError,
    which begins with the name of the file, and ModuleNotFoundError without trimesh.
    """
    label = show(path.name)
    if not os.path.isfile(path):
        raise UserError(f"{show(path)}: no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{label}: not a mesh by its suffix; this program reads {' '.join(SUFFIXES)}")
    import trimesh

    try:
        mesh = trimesh.load(path, process=False)
        if isinstance(mesh, trimesh.Scene):  # load(force="mesh") would drop the normals of other files.
            mesh = mesh.to_mesh()
        if isinstance(mesh, trimesh.PointCloud):
            mesh = mesh_of_strips(mesh) or mesh
    except Exception as error:  # On damaged files, readers of trimesh raise exceptions of all types.
        # ImportError: trimesh tried to guess the encoding of a binary file.
        text = "" if isinstance(error, ImportError) else str(error)
        reason = show(text.splitlines()[0] if text else "damaged")[:160]
        raise UserError(f"{label}: not a readable {path.suffix[1:].upper()} file ({reason})") from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise UserError(f"{label}: no triangles{why}")
    if mesh.vertices.ndim != 2 or mesh.vertices.shape[1] != 3:
        raise UserError(f"{label}: vertices of {mesh.vertices.shape[-1]} coordinates; three are needed")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise UserError(f"{label}: triangles refer to missing vertices; repair the file")
    if not np.abs(mesh.vertices[mesh.referenced_vertices]).max() <= LARGEST:
        raise UserError(f"{label}: vertex coordinates that are not finite (NaN, infinity, huge); repair the file")
    return mesh


def mesh_files(path: Path) -> list[Path]:
    """List the files that `load_mesh` reads: the mesh, the materials of an OBJ, and their images."""
    files = [path]
    if path.suffix.lower() == ".obj":
        files += (library := _named(path, rb"mtllib"))
        files += [image for material in library for image in _named(material, rb"map_\w+")]
    elif path.suffix.lower() == ".ply":
        files += _named(path, rb"comment[ \t]+TextureFile", LONGEST_HEADER)
    return files


def _named(path: Path, keyword: bytes, length: int = -1) -> list[Path]:
    """List the files that lines with a keyword name, in the first `length` bytes. Options before a name are skipped."""
    try:
        with path.open("rb") as file:
            content = file.read(length) if path.is_file() else b""
    except OSError:
        return []
    values = re.findall(rb"^[ \t]*" + keyword + rb"[ \t]+(\S[^\r\n]*)", content, re.MULTILINE)
    names = [value.split()[-1] if value.startswith(b"-") else value.rstrip() for value in values]
    return [path.parent / os.fsdecode(name) for name in names if b"\0" not in name]
