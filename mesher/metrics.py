"""Metrics of two surfaces. Points and distances are in model units."""

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .grid import sorted_unique
from .surface import Mesh, Whole

Doubles = NDArray[np.float64]

VOXEL = 0.01
"""Side of a voxel, and half the thickness of a shell, model units."""


class SampledSurface:
    """A mesh for sampling and distance queries, with areas, normals and a tree of its triangles.

    Faces without area are dropped: the indices of faces skip them.
    """

    normals: Doubles
    """(F, 3) unit normals of the faces with an area."""

    def __init__(self, mesh: Mesh) -> None:
        """mesh: at least one face has an area."""
        self.mesh = mesh
        self._vertices = mesh.vertices.astype(np.float64)
        corners = self._vertices[mesh.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(cross, axis=1)
        flat = lengths == 0
        self._faces = np.ascontiguousarray(mesh.faces[~flat])
        self._areas = np.cumsum(lengths[~flat])
        self.normals = cross[~flat] / lengths[~flat, None]
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._faces)

    def sample(self, count: int, rng: np.random.Generator) -> tuple[Doubles, Whole]:
        """Draw points (count, 3), uniform by area; return the points and their faces (count,)."""
        face = np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")
        u, v = rng.random((2, count))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        weights = np.stack((1 - u - v, u, v), axis=1)[:, :, None]
        return (self._vertices[self._faces[face]] * weights).sum(axis=1), face

    def distance(self, points: Doubles) -> tuple[Doubles, Whole]:
        """Return the exact distance (N,) of points (N, 3) to the surface, and the index of the nearest face (N,)."""
        squared, face, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.sqrt(squared), np.asarray(face, np.int64)


def chamfer(a: Doubles, b: Doubles) -> float:
    """Squared-L2 Chamfer distance of samplings (N, 3) and (M, 3): the sum of both directions' means (Section 4)."""
    forth, back = (cKDTree(there).query(here, workers=-1)[0] for here, there in ((a, b), (b, a)))
    return float(np.square(forth).mean() + np.square(back).mean())


def angles(a: Doubles, b: Doubles) -> Doubles:
    """Angles (N,), in degrees, between unit vectors (N, 3) and (N, 3)."""
    return np.asarray(np.rad2deg(np.arccos(np.clip(np.einsum("ij,ij->i", a, b), -1, 1))))


def shell_iou(a: SampledSurface, b: SampledSurface, samples: Doubles) -> float:
    """Intersection over union of two shells.

    The shell of a surface is the set of voxels of side `VOXEL` with centers within `VOXEL` of the surface. samples:
    (N, 3), dense on both surfaces, limit the search to nearby voxels.
    """
    around = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 3)
    touched = _unique(np.floor(samples / VOXEL).astype(np.int64))
    centers: Doubles = VOXEL * (_unique((touched[:, None] + around).reshape(-1, 3)).astype(np.float64) + 0.5)
    inside_a, inside_b = (surface.distance(centers)[0] <= VOXEL for surface in (a, b))
    return float((inside_a & inside_b).sum() / (inside_a | inside_b).sum())


def _unique(voxels: Whole) -> Whole:
    """Return the unique voxels (M, 3) of integers (N, 3)."""
    lowest = voxels.min(axis=0)
    size = (voxels.max(axis=0) - lowest + 1).tolist()
    keys = sorted_unique(np.ravel_multi_index(tuple((voxels - lowest).T), size))
    return np.asarray(np.stack(np.unravel_index(keys, size), axis=1) + lowest)
