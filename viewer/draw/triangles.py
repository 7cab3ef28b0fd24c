"""Reads mesh files as triangles in the space of a model, for the rasteriser and for the edges over a picture."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from ...model.files import show
from ...model.mesh_file import load_mesh
from ...model.model import MODEL_SPACE, Model
from ...model.orientation import DEFAULT_UP, upright

LEAST_REACH, MOST_REACH = 0.01, 100.0
"""Bounds of how far a mesh reaches from the shape's centre, in radii of the shape: others are not of the same shape."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A triangle mesh in model space."""

    vertices: NDArray[np.float32]
    """(V, 3), model units."""
    normals: NDArray[np.float32]
    """(V, 3), one for each vertex, of any length; 0 where it has none."""
    faces: NDArray[np.int32]
    """(F, 3), indices of the vertices of each triangle."""

    @property
    def reach(self) -> float:
        """Largest distance of a triangle's corner from the origin, in model units."""
        return float(np.linalg.norm(self.vertices[self.faces], axis=-1).max())


def read_triangles(path: Path, centre: tuple[float, float, float], scale: float, up: str = DEFAULT_UP) -> Triangles:
    """Read a PLY, OBJ, STL or GLB file into model space. centre, scale, up: those of a model (`Model.place`).

    Normals are those of a PLY or OBJ, where it has any, else the means of the faces' normals around each vertex; those
    of a closed mesh point outwards. Raises UserError, one line, where the file cannot be read, or where its size and
    place do not fit the shape.
    """
    try:
        mesh = load_mesh(path)
    except ModuleNotFoundError as error:
        raise UserError(f"--mesh needs the package '{error.name}'; run: pip install 'mplicits[mesh]'") from None
    if path.suffix.lower() == ".stl":
        mesh.merge_vertices()  # an STL repeats each corner in each triangle
    with np.errstate(all="ignore"):  # what is not finite is refused below
        vertices = (upright(np.asarray(mesh.vertices, np.float64), up) - centre) / scale
        normals = upright(np.array(mesh.vertex_normals, np.float64), up)
    faces = np.asarray(mesh.faces, np.int32)
    used = vertices[faces]
    reach = float(np.linalg.norm(used, axis=-1).max())
    if not LEAST_REACH <= reach <= MOST_REACH:
        raise UserError(
            f"{show(path.name)}: it reaches {reach:.3g} radii of the model's shape from that one's centre, so the two "
            "are not in one space; --space model for a mesh in model space, else take one of the shape trained on"
        )
    normals[~np.isfinite(normals).all(axis=1)] = 0.0
    if mesh.is_watertight and _flux(used, normals[faces]) < 0:
        normals = -normals
    return Triangles(vertices.astype(np.float32), normals.astype(np.float32), faces)


def read_triangles_for(model: Model, path: Path, space: str) -> Triangles:
    """Read a mesh of the model's shape, as `read_triangles` does.

    space: of the file's coordinates; "input", that of the shape which the model was trained on, or "model".
    """
    return read_triangles(path, *(MODEL_SPACE if space == "model" else model.place))


def _flux(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    """Return the flux of the position through a surface; its sign says whether the normals point outwards.

    corners, normals: (F, 3, 3), of each triangle and corner. With exact normals it is three times the volume.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return float((corners.mean(axis=1) * normals.mean(axis=1)).sum(axis=1) @ areas)
