"""Files of triangle meshes, read by trimesh (extra `mesh`) and checked."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .errors import UserError
from .files import show

if TYPE_CHECKING:
    import trimesh

SUFFIXES = (".ply", ".obj", ".stl", ".glb")
LARGEST = 1e30
"""Coordinate in a file whose powers are still numbers."""


def load_mesh(path: Path, why: str = "") -> "trimesh.Trimesh":
    """The triangles of a PLY, OBJ, STL or GLB file as they stand there, with the normals of a PLY or OBJ.

    why: said after "no triangles in it". Raises UserError, one line, and ModuleNotFoundError without trimesh.
    """
    label = show(path.name)
    if not os.path.isfile(path):
        raise UserError(f"{show(path)}: no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{label}: not a mesh by its ending; this program reads {' '.join(SUFFIXES)}")
    import trimesh

    try:
        mesh = trimesh.load(path, process=False)
        if isinstance(mesh, trimesh.Scene):  # `force` would drop the normals of all others
            mesh = mesh.to_mesh()
    except Exception as error:  # trimesh's readers raise anything on damaged files
        said = "" if isinstance(error, ImportError) else str(error)  # it misses a guesser of encodings: no text at all
        reason = show(said.splitlines()[0] if said else "damaged")[:160]
        raise UserError(f"{label}: not a readable {path.suffix[1:].upper()} file ({reason})") from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise UserError(f"{label}: no triangles in it{why}")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise UserError(f"{label}: triangles of vertices that are not in it; repair the file")
    if not np.abs(mesh.vertices[mesh.referenced_vertices]).max() <= LARGEST:
        raise UserError(f"{label}: vertex coordinates that are not finite (NaN, infinity, huge); repair the file")
    return mesh
