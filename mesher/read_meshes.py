"""Meshes from files for `eval`: the ground truth, or a reconstruction by another method."""

import math
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from ..model.orientation import DEFAULT_UP, upright
from ..readers.surface import load_mesh
from .surface import Mesh

FARTHEST = 100.0
"""Largest coordinate in model space of a mesh that may be the same shape."""


def read_mesh(path: Path, *, follow: bool = False) -> trimesh.Trimesh:
    """Read a PLY, OBJ, STL or GLB file as a surface: merge coincident vertices, and orient the faces outwards.

    follow: whether the file may name files outside of its folder. Raises UserError if the file holds no surface.
    """
    mesh = load_mesh(path, "; a comparison needs two surfaces", follow=follow)
    mesh.remove_unreferenced_vertices()
    largest = float(np.abs(mesh.vertices).max())
    # Merge vertices that differ by less than 1e-8 of the shape's size.
    digits = 8 - math.ceil(math.log10(largest)) if largest > 0 else 8
    mesh.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=digits)
    mesh.update_faces((mesh.faces != np.roll(mesh.faces, 1, axis=1)).all(axis=1))
    if not mesh.area > 0:
        raise UserError(f"{show(path.name)}: every triangle has zero area")
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def normalization(mesh: trimesh.Trimesh) -> tuple[tuple[float, float, float], float]:
    """Return the center and the scale that map a mesh into the unit sphere (Section 4).

    The center is the center of the bounding box, the scale is the largest distance of a vertex from the center.
    """
    used: NDArray[np.float64] = mesh.vertices[np.unique(mesh.faces)]
    x, y, z = (used.min(axis=0) + used.max(axis=0)) / 2
    return (float(x), float(y), float(z)), float(np.linalg.norm(used - (x, y, z), axis=1).max())


def in_model_space(
    mesh: trimesh.Trimesh, center: tuple[float, float, float], scale: float, up: str = DEFAULT_UP
) -> Mesh:
    """Map a mesh from input space to model space. center, scale, up: `Model.place`.

    Raises UserError if the result is far from the unit sphere, because center and scale belong to another shape.
    """
    vertices = (upright(np.asarray(mesh.vertices, np.float64), up) - center) / scale
    reach = np.abs(vertices).max()
    if not reach <= FARTHEST:
        raise UserError(f"the two are different shapes: one is {reach:.3g} radii away, by the other's center and scale")
    return Mesh(vertices.astype(np.float32), np.asarray(mesh.faces, np.int64))
