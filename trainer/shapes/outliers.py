"""Points of a cloud that belong to no surface."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles

NEIGHBOURS = 16
"""Nearest neighbours that a point is compared with."""
FAR = 3.0
"""A point may be an outlier where these are farther away than at a usual point of the cloud, by this factor."""
LONELY = 2.5
"""It is one where they are farther away from it than from their own neighbours, by this factor."""
AGREE = 0.5
"""Two points support one another where the cosine of their normals is larger, and that of the normals' mean and the
line between them smaller."""
SUPPORT = 0.7
"""It is one, too, where a smaller share of its neighbours supports it: a sparse part of a surface is none."""
FEWEST = 1e-3
"""A cloud with a smaller share of outliers has none: nothing is removed from it."""


def outliers(points: Doubles, normals: Doubles) -> NDArray[np.bool_]:
    """Tell which points (N, 3) with unit normals (N, 3) lie off the surface that the others are of: (N,).

    Outliers closer to the surface than some spacings of the points are not found.
    """
    count = min(NEIGHBOURS, len(points) - 1)
    distance, index = (np.asarray(part) for part in cKDTree(points).query(points, k=count + 1, workers=-1))
    reach = distance[:, -1]
    far = np.flatnonzero(reach > FAR * np.median(reach))
    near, between = index[far, 1:], points[index[far, 1:]] - points[far, None]
    lonely = reach[far] > LONELY * np.median(reach[near], axis=1)
    cosine = np.einsum("ijk,ik->ij", normals[near], normals[far])
    mean = (normals[near] + normals[far, None]) / 2
    beside = np.abs(np.einsum("ijk,ijk->ij", mean, between)) < AGREE * distance[far, 1:]
    supported = ((cosine > AGREE) & beside).mean(axis=1) >= SUPPORT
    found = np.zeros(len(points), np.bool_)
    found[far] = lonely | ~supported
    return found if found.mean() >= FEWEST else np.zeros_like(found)
