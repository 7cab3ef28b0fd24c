"""Mesh files, for comparison: the ground truth, or somebody else's reconstruction."""

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from codegen.errors import UserError
from codegen.files import show

from .surface import Mesh

SUFFIXES = (".ply", ".obj", ".stl", ".glb")


def read_mesh(path: Path) -> trimesh.Trimesh:
    """The triangles of a PLY, OBJ, STL or GLB file, faces outwards. Raises UserError, one line."""
    label = show(path.name)
    if not path.is_file():
        raise UserError(f"{show(path)}: no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{label}: not a mesh by its ending; this program reads {' '.join(SUFFIXES)}")
    try:
        mesh = trimesh.load(path, process=False, force="mesh")
    except Exception as error:  # trimesh's readers raise anything on damaged files
        reason = show(str(error).splitlines()[0] if str(error) else type(error).__name__)[:160]
        raise UserError(f"{label}: not a readable {path.suffix[1:].upper()} file ({reason})") from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise UserError(f"{label}: no triangles in it; a comparison needs two surfaces")
    if not np.isfinite(mesh.vertices).all():
        raise UserError(f"{label}: vertex coordinates that are not finite (NaN or infinity); repair the file")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    if not mesh.area > 0:
        raise UserError(f"{label}: every triangle has zero area")
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def normalisation(mesh: trimesh.Trimesh) -> tuple[tuple[float, float, float], float]:
    """Centre and scale that put the mesh into the unit sphere (Section 4): bounding box's centre, largest norm."""
    used: NDArray[np.float64] = mesh.vertices[np.unique(mesh.faces)]
    x, y, z = (used.min(axis=0) + used.max(axis=0)) / 2
    return (float(x), float(y), float(z)), float(np.linalg.norm(used - (x, y, z), axis=1).max())


def in_model_space(mesh: trimesh.Trimesh, centre: tuple[float, float, float], scale: float) -> Mesh:
    """The mesh where input space = model space * scale + centre."""
    vertices = (np.asarray(mesh.vertices, np.float64) - centre) / scale
    return Mesh(vertices.astype(np.float32), np.asarray(mesh.faces, np.int64))
