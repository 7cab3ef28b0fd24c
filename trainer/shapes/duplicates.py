"""Merges the points of a cloud that share a place: they add no information, and a k-d tree cannot separate them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles, SurfacePoints, unit

APART = 1e-6  # points closer than this share of half the bounding box's diagonal, ten float32 steps, are duplicates
CANCELED = 0.1  # length of a mean normal below which the normals at one place contradict each other


@dataclass(frozen=True, eq=False)
class Merged:
    """A cloud without duplicates."""

    surface: SurfacePoints
    merged: int
    """Number of points that were merged into another one."""
    dropped: int
    """Number of places that were removed because their normals cancel."""


def merge(surface: SurfacePoints, apart: float = APART) -> Merged:
    """Merge points at one place: the first stays, with the mean normal and the mean color.

    apart: distance of duplicates, in the unit of `APART`.
    """
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    first_point = _groups((surface.points - low) / (float(np.linalg.norm(high - low)) / 2 * apart))
    first, group, counts = np.unique(first_point, return_inverse=True, return_counts=True)
    group = group.ravel()
    normals = _means(surface.normals, group, counts)
    kept = np.linalg.norm(normals, axis=1) >= CANCELED
    colors = None if surface.colors is None else _means(surface.colors, group, counts)[kept]
    result = SurfacePoints(surface.points[first][kept], unit(normals[kept]), colors)
    return Merged(result, len(group) - len(first), int(np.count_nonzero(~kept)))


def _groups(points: Doubles) -> NDArray[np.int64]:
    """Group points (N, 3) that are less than 1 apart. Returns the index of each group's first point, (N,).

    The first points of two groups are at least 1 apart.
    """
    _, first, cell = np.unique(np.floor(points).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    # One point stands for each cell of a grid; only pairs across the sides of cells remain.
    order = np.argsort(first)
    first, rank = first[order], np.argsort(order)
    joined = np.arange(len(first))
    for one, other in _pairs(points[first]):
        if joined[one] == one and joined[other] == other:
            joined[other] = one
    return first[joined][rank[cell.ravel()]]


def _pairs(points: Doubles) -> NDArray[np.int64]:
    """Find the pairs (P, 2) of points at most 1 apart, in order, the lower index first."""
    pairs: NDArray[np.int64] = cKDTree(points).query_pairs(1.0, output_type="ndarray")
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def _means(values: Doubles, group: NDArray[np.int64], counts: NDArray[np.int64]) -> Doubles:
    """Average values (N, 3) over groups. Returns (G, 3)."""
    return np.stack([np.bincount(group, column, len(counts)) for column in values.T], axis=1) / counts[:, None]
