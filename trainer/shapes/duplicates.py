"""Points of a cloud at one place become one point, since they tell nothing more and a tree cannot part them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles, SurfacePoints, unit

APART = 1e-6
"""Points nearer to one another than this, as a share of half the diagonal of their bounding box, are at one place.

It is some ten times as far as float32 can tell them apart.
"""
CANCELLED = 0.1
"""Length of a mean normal below which the normals at one place cancel: they do not say which side is outside."""


@dataclass(frozen=True, eq=False)
class Merged:
    """A cloud without duplicates."""

    surface: SurfacePoints
    merged: int
    """Points that were at the place of another one."""
    dropped: int
    """Places that were left out because their normals cancel."""


def merge(surface: SurfacePoints, apart: float = APART) -> Merged:
    """Merge the points that are at one place: the first of them stays, with the mean of their normals and colours.

    apart: points nearer to one another than this are; a share of half the diagonal, as `APART`.
    """
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    group = _groups((surface.points - low) / (float(np.linalg.norm(high - low)) / 2 * apart))
    places, first, counts = np.unique(group, return_index=True, return_counts=True)
    order = np.argsort(first)
    index = np.empty(len(places), np.int64)
    index[order] = np.arange(len(places))
    group, first, counts = index[np.searchsorted(places, group)], first[order], counts[order]
    normals = _means(surface.normals, group, counts)
    kept = np.linalg.norm(normals, axis=1) >= CANCELLED
    colours = None if surface.colours is None else _means(surface.colours, group, counts)[kept]
    result = SurfacePoints(surface.points[first][kept], unit(normals[kept]), colours)
    return Merged(result, len(group) - len(places), int(np.count_nonzero(~kept)))


def _groups(points: Doubles) -> NDArray[np.int64]:
    """Number the places of points (N, 3), which are one where they are less than 1 apart.

    Each has the number of its first point, and these are at least 1 apart.
    """
    _, first, cell = np.unique(np.floor(points).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    # One point stands for each cell of a grid; what is left to merge are pairs across the cells' sides.
    order = np.argsort(first)
    first, rank = first[order], np.argsort(order)
    joined = np.arange(len(first))
    for one, other in _pairs(points[first]):
        if joined[one] == one and joined[other] == other:
            joined[other] = one
    return first[joined][rank[cell.ravel()]]


def _pairs(points: Doubles) -> NDArray[np.int64]:
    """Find the pairs (P, 2) of points that are at most 1 apart, in order, the lower number first."""
    pairs: NDArray[np.int64] = cKDTree(points).query_pairs(1.0, output_type="ndarray")
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def _means(values: Doubles, group: NDArray[np.int64], counts: NDArray[np.int64]) -> Doubles:
    """Average values (N, 3) over groups. Returns (G, 3)."""
    return np.stack([np.bincount(group, column, len(counts)) for column in values.T], axis=1) / counts[:, None]
