"""Distances to a mesh, in bounded time for millions of faces.

libigl's tree over the faces is fast near the surface. Where many faces are about equally far, as at the center of a
ball, it visits nearly all of them: 40 ms for one point and two million faces.
"""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles

MANY = 250_000  # meshes with more faces use samples of the surface for points farther than NEAR
NEAR = 0.1  # distance, model units, up to which the result is exact
MARGIN = 0.1  # largest relative error of the coarse distance at NEAR
SAMPLES, COARSE = 500_000, 20_000  # samples of the surface, and how many of them the first, coarse search visits
ROUNDS, NEIGHBORS = 3, 24  # each round moves a point's nearest sample to the best of this number of samples around it
CHUNK = 16_384  # points per block, which bounds the memory


class MeshDistance:
    """Unsigned distances to the faces of a mesh in model space."""

    def __init__(self, tree: Any, vertices: Doubles, faces: NDArray[np.int64], areas: Doubles) -> None:
        """tree: igl.AABB of the mesh. areas: (F,), cumulative areas of the faces."""
        self._tree, self._vertices, self._faces = tree, vertices, faces
        self._many = len(faces) > MANY
        if self._many:
            rng = np.random.default_rng(0)
            self._face = np.searchsorted(areas, rng.random(SAMPLES) * areas[-1], side="right")
            u, v = np.sort(rng.random((2, SAMPLES)), axis=0)
            weights = np.stack((u, v - u, 1 - v), axis=1)[:, :, None]
            self._samples = (vertices[faces[self._face]] * weights).sum(axis=1)
            self._fine, self._coarse = cKDTree(self._samples), cKDTree(self._samples[:COARSE])

    def __call__(self, points: Doubles) -> Doubles:
        """Compute distances (N,) at points (N, 3).

        Meshes of more than MANY faces are exact up to NEAR. Beyond, the result is the distance to the face of a nearly
        nearest sample, too large by about the squared spacing of the samples.
        """
        if not self._many:
            return self._exact(points)
        parts = [self._part(points[start : start + CHUNK]) for start in range(0, len(points), CHUNK)]
        return np.concatenate(parts) if parts else np.empty(0)

    def _part(self, points: Doubles) -> Doubles:
        result, sample = (np.asarray(found) for found in self._coarse.query(points, workers=-1))
        far = result > NEAR
        result[far] = self._far(points[far], sample[far])
        near = result <= NEAR * (1 + MARGIN)
        result[near] = self._exact(points[near])
        return result

    def _far(self, points: Doubles, sample: NDArray[np.intp]) -> Doubles:
        """Compute distances to the faces of nearly nearest samples. sample: (N,), where the search starts."""
        for _ in range(ROUNDS):
            around = np.asarray(self._fine.query(self._samples[sample], k=NEIGHBORS, workers=-1)[1])
            squared = ((self._samples[around] - points[:, None]) ** 2).sum(axis=2)
            sample = around[np.arange(len(points)), squared.argmin(axis=1)]
        closest_point: Any = trimesh.triangles.closest_point
        nearest = closest_point(self._vertices[self._faces[self._face[sample]]], points)
        return np.asarray(np.linalg.norm(nearest - points, axis=1))

    def _exact(self, points: Doubles) -> Doubles:
        squared, _, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.asarray(np.sqrt(squared))
