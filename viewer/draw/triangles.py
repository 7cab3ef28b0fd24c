"""A mesh file as triangles in a model's space, for the rasteriser."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from ...model.files import show
from ...model.mesh_file import load_mesh
from ...model.model import Model

FARTHEST, SMALLEST = 100.0, 0.01
"""Largest distance from the centre, in radii of the shape, of a mesh that can be one of the model's shape."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """vertices, normals: (V, 3) float32, model space, normals of any length; faces: (F, 3) int32."""

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    faces: NDArray[np.int32]

    @property
    def reach(self) -> float:
        """Largest distance of a corner from the origin."""
        return float(np.linalg.norm(self.vertices[self.faces], axis=-1).max())


def read_triangles(path: Path, centre: tuple[float, float, float], scale: float) -> Triangles:
    """The triangles of a PLY, OBJ, STL or GLB file, where its space = model space * scale + centre.

    Normals are those of a PLY or OBJ, where it has any, else means of the faces' around each vertex; those of a closed
    mesh point outwards. Raises UserError, one line.
    """
    try:
        mesh = load_mesh(path)
    except ModuleNotFoundError as error:
        raise UserError(f"--mesh needs the package '{error.name}'; run: pip install 'mplicits[mesh]'") from None
    if path.suffix.lower() == ".stl":
        mesh.merge_vertices()  # an STL repeats each corner in each triangle
    with np.errstate(all="ignore"):  # what is not finite is refused below
        vertices = (np.asarray(mesh.vertices, np.float64) - centre) / scale
        normals = np.array(mesh.vertex_normals, np.float64)
    faces = np.asarray(mesh.faces, np.int32)
    used = vertices[faces]
    reach = float(np.linalg.norm(used, axis=-1).max())
    if not SMALLEST <= reach <= FARTHEST:
        raise UserError(
            f"{show(path.name)}: it reaches {reach:.3g} radii of the model's shape from that one's centre, so the two "
            "are not in one space; --space model for a mesh in model space, else take one of the shape trained on"
        )
    normals[~np.isfinite(normals).all(axis=1)] = 0.0
    if mesh.is_watertight and _flux(used, normals[faces]) < 0:
        normals = -normals
    return Triangles(vertices.astype(np.float32), normals.astype(np.float32), faces)


def read_mesh_of(model: Model, path: Path, space: str) -> Triangles:
    """`read_triangles` in the space "input", of the shape that the model was trained on, or "model"."""
    return read_triangles(path, *(((0.0, 0.0, 0.0), 1.0) if space == "model" else (model.centre, model.scale)))


def _flux(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    """Of the position through the surface, three times the volume where the normals, (F, 3, 3) as well, are exact."""
    a, b, c = np.moveaxis(corners, 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return float((corners.mean(axis=1) * normals.mean(axis=1)).sum(axis=1) @ areas)
