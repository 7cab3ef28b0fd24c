"""Normals for a point cloud that has none: of planes through neighbours, turned outwards one after another.

This is Hoppe et al. (1992): the normal of a point is the direction in which its neighbours spread least, and the side
is handed on from point to point along the minimum spanning tree of a graph whose edges cost more where normals turn.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from .shape import Doubles

NEIGHBOURS = 12
"""Nearest neighbours of a point, by which its normal is estimated and to which its side is handed on."""
LEAST_COST = 1e-6
"""Cost of an edge between equal normals: a sparse graph has no edges of cost zero."""
CHUNK = 65_536
"""Points that are worked on at once."""


def estimated_normals(points: Doubles) -> tuple[Doubles, int]:
    """Estimate outward unit normals of points (N, 3), of which no two are at one place.

    Returns them (N, 3), and the number of pieces whose sides were decided one by one: a piece's normals look outwards
    as seen from it alone, so that a cavity comes out as a solid.
    """
    count = min(NEIGHBOURS, len(points) - 1)
    distance, near = (np.asarray(part) for part in cKDTree(points).query(points, k=count + 1, workers=-1))
    normals = np.concatenate(
        [_least_spread(points[near[start : start + CHUNK]]) for start in range(0, len(points), CHUNK)]
    )
    one, other = np.repeat(np.arange(len(points)), count), near[:, 1:].ravel()
    cosine = np.einsum("ij,ij->i", normals[one], normals[other])
    graph = coo_array((1 - np.abs(cosine) + LEAST_COST, (one, other)), shape=(len(points), len(points))).tocsr()
    # Both directions of an edge have one cost, but near[] may name only one of them.
    tree = minimum_spanning_tree(graph.maximum(graph.T))
    pieces, piece = connected_components(tree, directed=False)
    normals *= _sides(tree, normals, piece)[:, None]
    # The flux of x - centre through a closed surface is three times its volume.
    centres = np.stack([np.bincount(piece, column) for column in points.T], axis=1) / np.bincount(piece)[:, None]
    flux = np.einsum("ij,ij->i", points - centres[piece], normals) * distance[:, -1] ** 2
    normals *= np.where(np.bincount(piece, flux) < 0, -1.0, 1.0)[piece][:, None]
    return normals, pieces


def _least_spread(neighbours: Doubles) -> Doubles:
    """Find the direction of least spread of each group of points (N, K, 3). Returns (N, 3), of length one."""
    offsets = neighbours - neighbours.mean(axis=1, keepdims=True)
    offsets /= np.maximum(np.abs(offsets).max(axis=(1, 2), keepdims=True), 1e-300)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    return np.asarray(vectors[:, :, 0])


def _sides(tree: csr_array, normals: Doubles, piece: NDArray[np.int32]) -> Doubles:
    """Hand the side of one normal of each piece on along a forest. Returns what to multiply by, 1 or -1: (N,)."""
    count = len(normals)
    roots = np.unique(piece, return_index=True)[1]
    # One more point, above all roots, makes the forest one tree.
    above = coo_array((np.ones(len(roots)), (np.full(len(roots), count), roots)), shape=(count + 1, count + 1))
    forest = tree.tocoo()
    whole = above + coo_array((forest.data, forest.coords), shape=above.shape)
    before = breadth_first_order(whole, count, directed=False)[1][:count]
    parent = np.where(before == count, np.arange(count), before)
    sides = np.where(np.einsum("ij,ij->i", normals, normals[parent]) < 0, -1.0, 1.0)
    # Each round, a point knows its side against an ancestor twice as far up.
    while (parent != parent[parent]).any():
        sides *= sides[parent]
        parent = parent[parent]
    return np.asarray(sides)
