"""How far a surface is from its ground truth. Points and distances are in radii of the unit sphere."""

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .surface import Mesh, Whole

Doubles = NDArray[np.float64]

VOXEL = 0.01
"""Side of a shell's voxels, and half its thickness."""


class Surface:
    """A mesh with what its metrics need, built once: areas, normals, a tree of its triangles."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._vertices = mesh.vertices.astype(np.float64)
        self._faces = np.ascontiguousarray(mesh.faces)
        corners = self._vertices[self._faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(cross, axis=1)
        self._areas = np.cumsum(lengths)
        self.normals = cross / np.maximum(lengths, 1e-300)[:, None]
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._faces)

    def sample(self, count: int, rng: np.random.Generator) -> tuple[Doubles, Whole]:
        """Points (count, 3), uniform by area, and the face (count,) that each lies on."""
        face = np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")
        u, v = rng.random((2, count))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        weights = np.stack((1 - u - v, u, v), axis=1)[:, :, None]
        return (self._vertices[self._faces[face]] * weights).sum(axis=1), face

    def distance(self, points: Doubles) -> tuple[Doubles, Whole]:
        """Exact distance (N,) of points (N, 3) to the triangles, and the closest one's number (N,)."""
        squared, face, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.sqrt(squared), np.asarray(face, np.int64)


def chamfer(a: Doubles, b: Doubles) -> float:
    """Squared-L2 Chamfer distance of two samplings (N, 3) and (M, 3): both directions' means, summed (Section 4)."""
    forth, back = (cKDTree(there).query(here, workers=-1)[0] for here, there in ((a, b), (b, a)))
    return float(np.square(forth).mean() + np.square(back).mean())


def angles(a: Doubles, b: Doubles) -> Doubles:
    """Angle between unit vectors (N, 3), degrees: (N,)."""
    return np.asarray(np.rad2deg(np.arccos(np.clip(np.einsum("ij,ij->i", a, b), -1, 1))))


def shell_iou(a: Surface, b: Surface, samples: Doubles) -> float:
    """Intersection over union of two shells: the voxels of side `VOXEL` whose centre is within `VOXEL` of the surface.

    samples: (N, 3), dense on both surfaces; they say only where to look.
    """
    cells = np.floor(samples / VOXEL).astype(np.int64)
    lowest, highest = cells.min(axis=0) - 1, cells.max(axis=0) + 1
    around = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 3)
    size = tuple(int(n) for n in highest - lowest + 1)
    found = np.zeros(size, np.bool_)
    for offset in around:
        found[tuple((cells + offset - lowest).T)] = True
    centres = (np.argwhere(found) + lowest + 0.5) * VOXEL
    inside_a, inside_b = (surface.distance(centres)[0] <= VOXEL for surface in (a, b))
    return float((inside_a & inside_b).sum() / (inside_a | inside_b).sum())
