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
NEAR = 0.1
"""Distance, as a share of the unit sphere's radius, up to which distances are those of that tree: exact."""
MARGIN = 0.1
"""Share by which a distance that is not exact may be too large at `NEAR`."""
SAMPLES = 500_000
"""Points of the surface by which what is farther away is measured."""
COARSE = 20_000
"""As many of them are looked at for each point, where it comes to the worst."""
ROUNDS, NEIGHBOURS = 3, 24
"""From the nearest of these, a point's foot moves so many times to the best of so many samples around it."""
CHUNK = 16_384
"""Points that are worked on at once."""


class Distances:
    """Unsigned distances to the faces of a mesh in model space."""

    def __init__(self, tree: Any, vertices: Doubles, faces: NDArray[np.int64], areas: Doubles) -> None:
        """tree: igl's AABB of the mesh. areas: of the faces, summed up, (F,)."""
        self._tree, self._vertices, self._faces = tree, vertices, faces
        self._many = len(faces) > MANY
        if self._many:
            rng = np.random.default_rng(0)
            self._of = np.searchsorted(areas, rng.random(SAMPLES) * areas[-1], side="right")
            u, v = np.sort(rng.random((2, SAMPLES)), axis=0)
            weights = np.stack((u, v - u, 1 - v), axis=1)[:, :, None]
            self._samples = (vertices[faces[self._of]] * weights).sum(axis=1)
            self._fine, self._coarse = cKDTree(self._samples), cKDTree(self._samples[:COARSE])

    def __call__(self, points: Doubles) -> Doubles:
        """Compute distances at points (N, 3). Returns (N,).

        They are exact up to `NEAR`, and in meshes of up to `MANY` faces; farther away they are those to the face of a
        sample that is nearly the nearest, and may be too large by some spacing of the samples squared.
        """
        if not self._many:
            return self._exact(points)
        parts = [self._part(points[start : start + CHUNK]) for start in range(0, len(points), CHUNK)]
        return np.concatenate(parts) if parts else np.empty(0)

    def _part(self, points: Doubles) -> Doubles:
        result, foot = (np.asarray(found) for found in self._coarse.query(points, workers=-1))
        far = result > NEAR
        result[far] = self._far(points[far], foot[far])
        near = result <= NEAR * (1 + MARGIN)
        result[near] = self._exact(points[near])
        return result

    def _far(self, points: Doubles, foot: NDArray[np.intp]) -> Doubles:
        """Compute distances to the faces of samples that are nearly the nearest. foot: (N,), samples to begin with."""
        for _ in range(ROUNDS):
            around = np.asarray(self._fine.query(self._samples[foot], k=NEIGHBOURS, workers=-1)[1])
            apart = ((self._samples[around] - points[:, None]) ** 2).sum(axis=2)
            foot = around[np.arange(len(points)), apart.argmin(axis=1)]
        closest: Any = trimesh.triangles.closest_point
        nearest = closest(self._vertices[self._faces[self._of[foot]]], points)
        return np.asarray(np.linalg.norm(nearest - points, axis=1))

    def _exact(self, points: Doubles) -> Doubles:
        squared, _, _ = self._tree.squared_distance(self._vertices, self._faces, points)
        return np.asarray(np.sqrt(squared))
