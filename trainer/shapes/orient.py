"""Normals for a point cloud that has none: of planes through neighbours, turned outwards one after another.

This is Hoppe et al. (1992): the normal of a point is the direction in which its neighbours spread least, and the side
is handed on from point to point along the minimum spanning tree of a graph whose edges cost more where normals turn.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from .outliers import outliers
from .shape import Doubles

NEIGHBOURS = 12
"""Nearest neighbours of a point, by which its normal is estimated and to which its side is handed on."""
WIDER = (24, 48, 96, 192)
"""By how many its normal is estimated where the cloud is noisy: the first at which neighbours look like a plane."""
FLAT = 0.35
"""They do where they spread by at most this share of the next larger spread in the direction of the normal."""
LOOKED_AT = 2000
"""Points by whose median that is decided."""
LEAST_COST = 1e-6
"""Cost of an edge between equal normals: a sparse graph has no edges of cost zero."""
CHUNK = 16_384
"""Points that are worked on at once."""


def estimated_normals(points: Doubles) -> tuple[Doubles, int]:
    """Estimate outward unit normals of points (N, 3), of which no two are at one place.

    Returns them (N, 3), and the number of pieces whose sides were decided one by one: a piece's normals look outwards
    as seen from it alone, so that a cavity comes out as a solid.
    """
    count = min(NEIGHBOURS, len(points) - 1)
    tree = cKDTree(points)
    distance, near = (np.asarray(part) for part in tree.query(points, k=count + 1, workers=-1))
    wide = _neighbours_of_a_plane(tree)
    normals = np.empty_like(points)
    for start in range(0, len(points), CHUNK):
        part = slice(start, start + CHUNK)
        around = near[part] if wide <= count else tree.query(points[part], k=wide + 1, workers=-1)[1]
        normals[part] = _spreads(points[around])[1][:, :, 0]
    one, other = np.repeat(np.arange(len(points)), count), near[:, 1:].ravel()
    cosine = np.einsum("ij,ij->i", normals[one], normals[other])
    graph = coo_array((1 - np.abs(cosine) + LEAST_COST, (one, other)), shape=(len(points), len(points))).tocsr()
    # Both directions of an edge have one cost, but near[] may name only one of them.
    forest = minimum_spanning_tree(graph.maximum(graph.T))
    pieces, piece = connected_components(forest, directed=False)
    normals *= _sides(forest, normals, piece)[:, None]
    # The flux of x - centre through a closed surface is three times its volume. Points off it, around which there is
    # much room, would outweigh it.
    centres = np.stack([np.bincount(piece, column) for column in points.T], axis=1) / np.bincount(piece)[:, None]
    flux = np.einsum("ij,ij->i", points - centres[piece], normals) * distance[:, -1] ** 2
    flux[outliers(points, normals)] = 0
    normals *= np.where(np.bincount(piece, flux) < 0, -1.0, 1.0)[piece][:, None]
    return normals, pieces


def _neighbours_of_a_plane(tree: cKDTree) -> int:
    """Choose how many neighbours normals are estimated by: as few as have more surface than noise in them."""
    points = np.asarray(tree.data)
    most = min(WIDER[-1], len(points) - 1)
    some = np.random.default_rng(0).choice(len(points), min(LOOKED_AT, len(points)), replace=False)
    near = np.asarray(tree.query(points[some], k=most + 1, workers=-1)[1])
    counts = [count for count in (NEIGHBOURS, *WIDER) if count <= most] or [most]
    for count in counts:
        spreads = _spreads(points[near[:, : count + 1]])[0]
        if np.median(spreads[:, 0] / np.maximum(spreads[:, 1], 1e-300)) <= FLAT**2:
            return count
    return counts[-1]


def _spreads(neighbours: Doubles) -> tuple[Doubles, Doubles]:
    """Compute the variances (N, 3) of each group of points (N, K, 3), the least first, and in which directions.

    The directions are columns: (N, 3, 3). Variances are relative to the group's size, squared.
    """
    offsets = neighbours - neighbours.mean(axis=1, keepdims=True)
    offsets /= np.maximum(np.abs(offsets).max(axis=(1, 2), keepdims=True), 1e-300)
    values, directions = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    return np.maximum(values, 0), directions


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
