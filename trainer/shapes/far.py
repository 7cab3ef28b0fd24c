"""Distances to a mesh of very many faces, in bounded time wherever they are asked for.

A tree over the faces finds the nearest one fast near the surface. Where many are equally far, as around the centre of a
ball, it has to look at nearly all of them: 40 ms for one point of a sphere of two million faces.
"""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles

MANY = 250_000
"""Faces up to which the tree over the faces is fast everywhere."""
NEAR = 0.06
"""Distance, as a share of the unit sphere's radius, up to which distances are those of that tree: exact."""
SAMPLES = 100_000
"""Points of the surface that a tree is built of for what is farther away."""
LOOSE = 2e-3
"""Share by which the sample that is found may be farther away than the nearest one."""
CANDIDATES = 4
"""Samples whose faces are compared."""
CHUNK = 65_536
"""Points that are worked on at once."""


class Distances:
    """Unsigned distances to the faces of a mesh in model space."""

    def __init__(self, tree: Any, vertices: Doubles, faces: NDArray[np.int64], areas: Doubles) -> None:
        """tree: igl's AABB of the mesh. areas: of the faces, summed up, (F,)."""
        self._tree, self._vertices, self._faces = tree, vertices, faces
        self._samples: cKDTree | None = None
        if len(faces) > MANY:
            rng = np.random.default_rng(0)
            self._of = np.searchsorted(areas, rng.random(SAMPLES) * areas[-1], side="right")
            u, v = np.sort(rng.random((2, SAMPLES)), axis=0)
            weights = np.stack((u, v - u, 1 - v), axis=1)[:, :, None]
            self._samples = cKDTree((vertices[faces[self._of]] * weights).sum(axis=1))

    def __call__(self, points: Doubles) -> Doubles:
        """Compute distances at points (N, 3). Returns (N,).

        They are exact up to `NEAR`, and in meshes of up to `MANY` faces; else they are too large by 0.2 % at most
        beside what the surface turns between two samples.
        """
        if self._samples is None:
            return self._exact(points)
        return np.concatenate(
            [self._part(self._samples, points[start : start + CHUNK]) for start in range(0, len(points), CHUNK)]
            or [np.empty(0)]
        )

    def _part(self, samples: cKDTree, points: Doubles) -> Doubles:
        distance, index = (np.asarray(part) for part in samples.query(points, k=CANDIDATES, eps=LOOSE, workers=-1))
        result = distance[:, 0].copy()
        far = np.flatnonzero(result > NEAR)
        faces = self._vertices[self._faces[self._of[index[far]]]].reshape(-1, 3, 3)
        origins = np.repeat(points[far], CANDIDATES, axis=0)
        closest: Any = trimesh.triangles.closest_point
        nearest = closest(faces, origins)
        result[far] = np.linalg.norm(nearest - origins, axis=1).reshape(-1, CANDIDATES).min(axis=1)
        near = result <= NEAR
        result[near] = self._exact(points[near])
        return result

    def _exact(self, points: Doubles) -> Doubles:
        squared, _, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.asarray(np.sqrt(squared))
