"""Distances to the surface of an oriented cloud: from local planes near its points, from the nearest point elsewhere.

The nearest point is farther away than the surface by up to one spacing of the points, which makes it useless within a
few spacings. The planes through the nearest points are wrong only by the surface's change of curvature.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles, unit

NEIGHBORS = 12  # nearest points whose planes are averaged
WIDTH = 0.8  # width of the Gaussian weights, in spacings
SPREAD = 0.4  # largest standard deviation of the distances to the planes, in spacings, at which their mean is used
SIDEWAYS = 1.6  # largest distance along the surface between the nearest point and the foot of a query, in spacings
TRUSTED, NOISY_TRUSTED = 8.0, 3.0
"""Least distance, in spacings, at which the distance to the nearest point is used; of a cloud that was noisy.

The relative error is half the inverse square of this number: 1 % at 8 spacings.
"""
CHUNK = 65_536  # queries per block, which bounds the memory


class LocalPlanes:
    """Signed distance near the points of an oriented cloud, where its planes agree.

    The planes are blended as in an implicit moving least-squares surface (Shen et al. 2004; Kolluri 2005). The normal
    of each is the mean of its point's normal and the blended normal (the symmetric objective of Rusinkiewicz 2019),
    so that the bulge of a sphere cancels.
    """

    def __init__(self, tree: cKDTree, normals: Doubles, spacings: Doubles) -> None:
        """normals: (N, 3), of the tree's points. spacings: (N,)."""
        self._tree, self._normals, self._spacings = tree, normals, spacings
        self._points = np.asarray(tree.data)

    def distance(self, points: Doubles) -> tuple[Doubles, Doubles]:
        """Compute distances at points (N, 3).

        Returns the signed distance to the planes (N,), NaN where the planes disagree, and the unsigned distance to the
        nearest point (N,), NaN closer than `TRUSTED`.
        """
        planes, nearest = np.empty(len(points)), np.empty(len(points))
        for start in range(0, len(points), CHUNK):
            part = slice(start, start + CHUNK)
            planes[part], nearest[part] = self._part(points[part])
        return planes, nearest

    def _part(self, points: Doubles) -> tuple[Doubles, Doubles]:
        count = min(NEIGHBORS, len(self._points))
        distance, index = (np.asarray(column) for column in self._tree.query(points, k=count, workers=-1))
        nearest, spacing = distance[:, 0], self._spacings[index[:, 0]]
        normals = self._normals[index]
        offsets = points[:, None] - self._points[index]
        # Squared distances along the surface, up to a constant: the height above it is nearly equal for all neighbors.
        along = (distance**2 - nearest[:, None] ** 2) / (WIDTH * spacing[:, None]) ** 2
        weight = np.exp(-along) * (np.einsum("nkc,nc->nk", normals, normals[:, 0]) > 0)
        weight /= weight.sum(axis=1, keepdims=True)
        blended = unit(np.einsum("nk,nkc->nc", weight, normals))
        heights = np.einsum("nkc,nkc->nk", offsets, (normals + blended[:, None]) / 2)
        f = np.einsum("nk,nk->n", weight, heights)
        spread = np.sqrt(np.einsum("nk,nk->n", weight, (heights - f[:, None]) ** 2))
        known: NDArray[np.bool_] = (spread < SPREAD * spacing) & (np.abs(nearest**2 - f**2) < (SIDEWAYS * spacing) ** 2)
        return np.where(known, f, np.nan), _nan_if_near(nearest, TRUSTED * spacing)


class NearestPoint:
    """Distance to the nearest point of a cloud that was noisy: its remaining noise tilts the planes."""

    def __init__(self, tree: cKDTree, spacings: Doubles) -> None:
        """spacings: (N,), of the tree's points."""
        self._tree, self._spacings = tree, spacings

    def distance(self, points: Doubles) -> tuple[Doubles, Doubles]:
        """Return the results of `LocalPlanes.distance`, the first of them NaN everywhere."""
        nearest, index = (np.asarray(column) for column in self._tree.query(points, workers=-1))
        return np.full(len(points), np.nan), _nan_if_near(nearest, NOISY_TRUSTED * self._spacings[index])


def _nan_if_near(nearest: Doubles, least: Doubles) -> Doubles:
    return np.where(nearest < least, np.nan, nearest)
