"""Reads mesh files as triangles in model space."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from ...model.files import show
from ...model.model import MODEL_SPACE, Model
from ...model.orientation import DEFAULT_UP, upright
from ...readers.surface import load_mesh

LEAST_REACH, MOST_REACH = 0.01, 100.0
"""Smallest and largest reach of a mesh, in radii of the shape; a mesh outside belongs to another shape or space."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A triangle mesh in model space."""

    vertices: NDArray[np.float32]
    """(V, 3), model units."""
    normals: NDArray[np.float32]
    """(V, 3), of any length; 0 for a vertex without a normal."""
    faces: NDArray[np.int32]
    """(F, 3), indices of vertices."""

    @property
    def reach(self) -> float:
        """Largest distance of a corner from the origin, model units."""
        return float(np.linalg.norm(self.vertices[self.faces], axis=-1).max())


def read_triangles(
    path: Path, center: tuple[float, float, float], scale: float, up: str = DEFAULT_UP, *, follow: bool = False
) -> Triangles:
    """Read a PLY, OBJ, STL or GLB file into model space. center, scale, up: see `Model.place`. follow: of `load_mesh`.

    Normals come from the file; else they are means of adjacent face normals, outward for a closed mesh.
    Raises UserError, one line, if the file is not readable, or its size and place do not fit the shape.
    """
    try:
        mesh = load_mesh(path, follow=follow)
    except ModuleNotFoundError as error:
        extra = "mesh" if error.name == "trimesh" else "formats"
        raise UserError(f"--mesh needs the package '{error.name}'; run: pip install 'mplicits[{extra}]'") from None
    if path.suffix.lower() == ".stl":
        mesh.merge_vertices()  # STL has no shared vertices
    with np.errstate(all="ignore"):  # numbers that are not finite fail below
        vertices = (upright(np.asarray(mesh.vertices, np.float64), up) - center) / scale
        normals = upright(np.array(mesh.vertex_normals, np.float64), up)
    faces = np.asarray(mesh.faces, np.int32)
    used = vertices[faces]
    reach = float(np.linalg.norm(used, axis=-1).max())
    if not LEAST_REACH <= reach <= MOST_REACH:
        raise UserError(
            f"{show(path.name)}: the mesh reaches {reach:.3g} radii of the model's shape from its center, so it is "
            "not in the same space; add --space model for a mesh in model space, or take a mesh of the trained shape"
        )
    normals[~np.isfinite(normals).all(axis=1)] = 0.0
    if mesh.is_watertight and _flux(used, normals[faces]) < 0:
        normals = -normals
    return Triangles(vertices.astype(np.float32), normals.astype(np.float32), faces)


def read_triangles_for(model: Model, path: Path, space: str, *, follow: bool = False) -> Triangles:
    """Read a mesh of the model's shape. space: of the file, "input" (as the trained shape) or "model"."""
    return read_triangles(path, *(MODEL_SPACE if space == "model" else model.place), follow=follow)


def _flux(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    """Return the flux of the position through a closed surface: positive if its normals point outward.

    corners, normals: (F, 3, 3), of each triangle and corner.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return float((corners.mean(axis=1) * normals.mean(axis=1)).sum(axis=1) @ areas)
