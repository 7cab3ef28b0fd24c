"""Finds the points of a cloud that lie off the surface."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles

NEIGHBORS = 16  # nearest neighbors that a point is compared with. The distance to the last one is the point's reach.
FAR = 3.0  # only points whose reach exceeds this multiple of the cloud's median reach can be outliers
LONELY = 2.5  # A point is an outlier if its reach exceeds this multiple of its neighbors' median reach
AGREE = 0.5
"""Two points support each other if the cosine of their normals is larger, and the cosine between the mean normal and
the line through both points is smaller."""
SUPPORT = 0.7
"""A point is an outlier, too, if a smaller share of its neighbors supports it; sparse parts of a surface do."""
FEWEST = 1e-3  # if a smaller share of the cloud is found, nothing is removed


def outliers(points: Doubles, normals: Doubles) -> NDArray[np.bool_]:
    """Find the points (N, 3) with unit normals (N, 3) that lie off the surface of the others. Returns a mask (N,).

    The mask omits outliers within a few spacings of the surface.
    """
    count = min(NEIGHBORS, len(points) - 1)
    distance, index = (np.asarray(part) for part in cKDTree(points).query(points, k=count + 1, workers=-1))
    reach = distance[:, -1]
    far = np.flatnonzero(reach > FAR * np.median(reach))
    near, offsets = index[far, 1:], points[index[far, 1:]] - points[far, None]
    lonely = reach[far] > LONELY * np.median(reach[near], axis=1)
    cosine = np.einsum("ijk,ik->ij", normals[near], normals[far])
    mean = (normals[near] + normals[far, None]) / 2
    beside = np.abs(np.einsum("ijk,ijk->ij", mean, offsets)) < AGREE * distance[far, 1:]
    supported = ((cosine > AGREE) & beside).mean(axis=1) >= SUPPORT
    found = np.zeros(len(points), np.bool_)
    found[far] = lonely | ~supported
    return found if found.mean() >= FEWEST else np.zeros_like(found)
