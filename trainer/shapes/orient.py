"""Estimates outward normals for a point cloud without normals (Hoppe et al. 1992).

The normal of a point is the direction in which its neighbors spread least. Its sign propagates from point to point
along the minimum spanning tree of a graph whose edges cost more where normals turn.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from .outliers import outliers
from .shape import Doubles

NEIGHBORS = 12  # neighbors of a point in the graph, and the fewest from which its normal is estimated
WIDER = (24, 48, 96, 192)  # larger neighborhoods for noisy clouds; the first one that is FLAT is used
FLAT = 0.35  # A neighborhood is flat if its smallest spread is at most this share of the next one, in the median
SAMPLE = 2000  # points at which flatness is measured
LEAST_COST = 1e-6  # cost of an edge between equal normals: a sparse graph drops edges of cost zero
CHUNK = 16_384  # points per block, which bounds the memory


def estimated_normals(points: Doubles) -> tuple[Doubles, int]:
    """Estimate outward unit normals of points (N, 3) without duplicates.

    Returns the normals (N, 3), and the number of connected components of the graph. Each component is oriented by
    itself, so that a cavity becomes a solid.
    """
    count = min(NEIGHBORS, len(points) - 1)
    tree = cKDTree(points)
    distance, near = (np.asarray(part) for part in tree.query(points, k=count + 1, workers=-1))
    wide = _flat_neighborhood(tree)
    normals = np.empty_like(points)
    for start in range(0, len(points), CHUNK):
        part = slice(start, start + CHUNK)
        around = near[part] if wide <= count else tree.query(points[part], k=wide + 1, workers=-1)[1]
        normals[part] = _spreads(points[around])[1][:, :, 0]
    one, other = np.repeat(np.arange(len(points)), count), near[:, 1:].ravel()
    cosine = np.einsum("ij,ij->i", normals[one], normals[other])
    graph = coo_array((1 - np.abs(cosine) + LEAST_COST, (one, other)), shape=(len(points), len(points))).tocsr()
    # The graph is undirected, but `near` may list an edge in one direction only.
    forest = minimum_spanning_tree(graph.maximum(graph.T))
    components, component = connected_components(forest, directed=False)
    normals *= _signs(forest, normals, component)[:, None]
    # The flux of x - center through a closed surface is three times its volume; outliers would dominate the sum.
    sizes = np.bincount(component)
    centers = np.stack([np.bincount(component, column) for column in points.T], axis=1) / sizes[:, None]
    flux = np.einsum("ij,ij->i", points - centers[component], normals) * distance[:, -1] ** 2
    flux[outliers(points, normals)] = 0
    normals *= np.where(np.bincount(component, flux) < 0, -1.0, 1.0)[component][:, None]
    return normals, components


def _flat_neighborhood(tree: cKDTree) -> int:
    """Choose the number of neighbors: the smallest one at which the surface outweighs the noise."""
    points = np.asarray(tree.data)
    most = min(WIDER[-1], len(points) - 1)
    sample = np.random.default_rng(0).choice(len(points), min(SAMPLE, len(points)), replace=False)
    near = np.asarray(tree.query(points[sample], k=most + 1, workers=-1)[1])
    counts = [count for count in (NEIGHBORS, *WIDER) if count <= most] or [most]
    for count in counts:
        spreads = _spreads(points[near[:, : count + 1]])[0]
        if np.median(spreads[:, 0] / np.maximum(spreads[:, 1], 1e-300)) <= FLAT**2:
            return count
    return counts[-1]


def _spreads(neighbors: Doubles) -> tuple[Doubles, Doubles]:
    """Compute the principal variances (N, 3), ascending, of groups of points (N, K, 3), relative to each group's size.

    Returns the variances, and their directions as columns (N, 3, 3).
    """
    offsets = neighbors - neighbors.mean(axis=1, keepdims=True)
    offsets /= np.maximum(np.abs(offsets).max(axis=(1, 2), keepdims=True), 1e-300)
    values, directions = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))
    return np.maximum(values, 0), directions


def _signs(tree: csr_array, normals: Doubles, component: NDArray[np.int32]) -> Doubles:
    """Propagate the sign of one normal of each component along a forest. Returns factors 1 or -1, (N,)."""
    count = len(normals)
    roots = np.unique(component, return_index=True)[1]
    # One extra point, the parent of all roots, turns the forest into one tree.
    above = coo_array((np.ones(len(roots)), (np.full(len(roots), count), roots)), shape=(count + 1, count + 1))
    forest = tree.tocoo()
    whole = above + coo_array((forest.data, forest.coords), shape=above.shape)
    parent = breadth_first_order(whole, count, directed=False)[1][:count]
    parent = np.where(parent == count, np.arange(count), parent)
    signs = np.where(np.einsum("ij,ij->i", normals, normals[parent]) < 0, -1.0, 1.0)
    while (parent != parent[parent]).any():  # each round doubles the distance to the ancestor
        signs *= signs[parent]
        parent = parent[parent]
    return np.asarray(signs)
