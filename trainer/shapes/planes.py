"""The distance to the surface that an oriented cloud stands for: near its points, by the planes through them.

The nearest point is farther away than the surface by up to a spacing of the points, and so tells nothing within some
spacings of it; the planes through the nearest points are off only by the surface's change of curvature.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles, unit

NEIGHBOURS = 12
"""Nearest points whose planes are averaged."""
WIDTH = 0.8
"""Width of the Gauss window that they are averaged with, in spacings."""
SPREAD = 0.4
"""Largest standard deviation of the distances to the planes, in spacings, at which their mean is the distance."""
SIDEWAYS = 1.6
"""Largest distance along the surface from the nearest point to the place below a query, in spacings."""
TRUSTED = 8.0
"""Distance, in spacings, from which on the nearest point of the cloud is as far as the surface to 1 %.

The error is half the squared ratio of the two.
"""
CHUNK = 65_536
"""Queries that are worked on at once."""


class LocalPlanes:
    """A signed distance that is known near the points of an oriented cloud, and where the surface is not too ragged.

    The planes are blended as in an implicit moving least-squares surface (Shen et al. 2004; Kolluri 2005). Each has the
    mean of its point's normal and the blended one (the symmetric objective of Rusinkiewicz 2019): a sphere's bulge is
    then the same on both, and cancels.
    """

    def __init__(self, tree: cKDTree, normals: Doubles, spacings: Doubles) -> None:
        """normals: (N, 3), unit, of the tree's points. spacings: of the points, (N,)."""
        self._tree, self._normals, self._spacings = tree, normals, spacings
        self._points = np.asarray(tree.data)

    def distance(self, points: Doubles) -> tuple[Doubles, Doubles]:
        """Compute distances at points (N, 3).

        Returns the signed distance by planes (N,), which is NaN where they do not agree, and the distance to the
        nearest point of the cloud (N,), without sign, which is NaN where it is too near to stand for the surface.
        """
        planes, nearest = np.empty(len(points)), np.empty(len(points))
        for start in range(0, len(points), CHUNK):
            part = slice(start, start + CHUNK)
            planes[part], nearest[part] = self._part(points[part])
        return planes, nearest

    def _part(self, points: Doubles) -> tuple[Doubles, Doubles]:
        count = min(NEIGHBOURS, len(self._points))
        distance, index = (np.asarray(column) for column in self._tree.query(points, k=count, workers=-1))
        nearest, spacing = distance[:, 0], self._spacings[index[:, 0]]
        normals = self._normals[index]
        offsets = points[:, None] - self._points[index]
        # Squared distances along the surface, up to one number for all: the height above it is nearly the same.
        along = (distance**2 - nearest[:, None] ** 2) / (WIDTH * spacing[:, None]) ** 2
        weight = np.exp(-along) * (np.einsum("nkc,nc->nk", normals, normals[:, 0]) > 0)
        weight /= weight.sum(axis=1, keepdims=True)
        blended = unit(np.einsum("nk,nkc->nc", weight, normals))
        heights = np.einsum("nkc,nkc->nk", offsets, (normals + blended[:, None]) / 2)
        f = np.einsum("nk,nk->n", weight, heights)
        spread = np.sqrt(np.einsum("nk,nk->n", weight, (heights - f[:, None]) ** 2))
        known: NDArray[np.bool_] = (spread < SPREAD * spacing) & (np.abs(nearest**2 - f**2) < (SIDEWAYS * spacing) ** 2)
        return np.where(known, f, np.nan), _if_far(nearest, spacing, TRUSTED)


class NearestPoint:
    """The distance to the nearest point, of a cloud whose planes say nothing.

    What the removal of noise has left of it tilts single planes, and f would be held to a few wrong signs.
    """

    def __init__(self, tree: cKDTree, spacings: Doubles, trusted: float) -> None:
        """spacings: of the tree's points, (N,). trusted: distance, in spacings, from which on it is the surface's."""
        self._tree, self._spacings, self._trusted = tree, spacings, trusted

    def distance(self, points: Doubles) -> tuple[Doubles, Doubles]:
        """Compute what `LocalPlanes.distance` does, without planes: the first of the two is NaN everywhere."""
        nearest, index = (np.asarray(column) for column in self._tree.query(points, workers=-1))
        return np.full(len(points), np.nan), _if_far(nearest, self._spacings[index], self._trusted)


def _if_far(nearest: Doubles, spacing: Doubles, least: float) -> Doubles:
    """Return distances, NaN where one is less than `least` spacings."""
    return np.where(nearest < least * spacing, np.nan, nearest)
