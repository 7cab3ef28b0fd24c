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
"""How the names of files that are taken for meshes end, in lower case."""
LARGEST = 1e30
"""Largest coordinate that a file may have: its powers are still finite numbers."""

LONGEST_HEADER = 65_536
"""Bytes of a PLY in which its header is looked for."""


def load_mesh(path: Path, why: str = "") -> "trimesh.Trimesh":
    """Read the triangles of a PLY, OBJ, STL or GLB file as they stand there, with the normals of a PLY or OBJ.

    why: what the message about a file without triangles goes on with, "; ... needs a surface", say. Raises UserError,
    one line that begins with the file's name, and ModuleNotFoundError where trimesh is not installed.
    """
    label = show(path.name)
    if not os.path.isfile(path):
        raise UserError(f"{show(path)}: no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{label}: not a mesh by its ending; this program reads {' '.join(SUFFIXES)}")
    import trimesh

    try:
        mesh = trimesh.load(path, process=False)
        if isinstance(mesh, trimesh.Scene):  # load(force="mesh") would drop the normals of files that are no scene.
            mesh = mesh.to_mesh()
        if isinstance(mesh, trimesh.PointCloud):
            mesh = mesh_of_strips(mesh) or mesh
    except Exception as error:  # On damaged files trimesh's readers raise anything.
        # An ImportError says that trimesh wants to guess an encoding, for the file is no text at all.
        text = "" if isinstance(error, ImportError) else str(error)
        reason = show(text.splitlines()[0] if text else "damaged")[:160]
        raise UserError(f"{label}: not a readable {path.suffix[1:].upper()} file ({reason})") from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise UserError(f"{label}: no triangles in it{why}")
    if mesh.vertices.ndim != 2 or mesh.vertices.shape[1] != 3:
        raise UserError(f"{label}: vertices of {mesh.vertices.shape[-1]} coordinates; three are needed")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise UserError(f"{label}: triangles of vertices that are not in it; repair the file")
    if not np.abs(mesh.vertices[mesh.referenced_vertices]).max() <= LARGEST:
        raise UserError(f"{label}: vertex coordinates that are not finite (NaN, infinity, huge); repair the file")
    return mesh


def mesh_files(path: Path) -> list[Path]:
    """List the files that reading a mesh reads: itself, the materials of an OBJ, and the images that are named there.

    A file that cannot be read names none.
    """
    files = [path]
    if path.suffix.lower() == ".obj":
        files += (library := _named(path, rb"mtllib"))
        files += [image for material in library for image in _named(material, rb"map_\w+")]
    elif path.suffix.lower() == ".ply":
        files += _named(path, rb"comment[ \t]+TextureFile", LONGEST_HEADER)
    return files


def _named(path: Path, keyword: bytes, length: int = -1) -> list[Path]:
    """List the files that the lines of a keyword, in the first bytes of a file, name: the last word after options."""
    try:
        with path.open("rb") as file:
            content = file.read(length) if path.is_file() else b""
    except OSError:
        return []
    values = re.findall(rb"^[ \t]*" + keyword + rb"[ \t]+(\S[^\r\n]*)", content, re.MULTILINE)
    names = [value.split()[-1] if value.startswith(b"-") else value.rstrip() for value in values]
    return [path.parent / os.fsdecode(name) for name in names if b"\0" not in name]
