"""Normals at the corners of a mesh's faces: smooth across edges, except for creases."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...readers.values import CornerValues
from .shape import Doubles, unit

Integers = NDArray[np.int64]

CHUNK = 1_000_000  # faces or edges per block, which bounds the memory
SHARPER = 2.5  # A crease bends this many times as much as the edges beside it
CREASE_COSINE = 0.94  # largest cosine between the normals of a crease's sides: 20 degrees
SHARP = 60.0  # an edge that bends by more degrees is a crease whatever its neighbors are: a cube, a nut
LEAST_COSINE = 0.2
"""A normal of a file is used if the cosine to its face's normal is larger: it may be damaged, or point inwards."""


def corner_normals(vertices: Doubles, faces: Integers, crease: float) -> CornerValues:
    """Average face normals around each vertex, up to the next crease, weighted by the faces' angles.

    vertices: (V, 3). faces: (F, 3). crease: least angle of a crease, degrees; see `_creases`.
    """
    of_faces = face_normals(vertices, faces)
    groups, group = _smooth_groups(vertices, faces, of_faces, crease)
    sums = np.zeros((groups, 3))
    for part in _chunks(len(faces)):
        weighted = of_faces[part, None] * corner_angles(vertices, faces[part])[:, :, None]
        at = group[part].ravel()
        for axis in range(3):
            sums[:, axis] += np.bincount(at, weighted[:, :, axis].ravel(), groups)
    values = unit(sums)
    canceled = np.flatnonzero((np.linalg.norm(values, axis=1) < 0.5)[group.ravel()])
    if len(canceled):
        group.reshape(-1)[canceled] = groups + np.arange(len(canceled))
        values = np.concatenate((values, of_faces[canceled // 3]))
    return CornerValues(values, group)


def usable_normals(vertices: Doubles, faces: Integers, stored: CornerValues, computed: CornerValues) -> CornerValues:
    """Use a file's normals, and computed ones where these do not fit their faces.

    vertices: (V, 3). faces: (F, 3). stored: the file's, of any length.
    """
    values = np.concatenate((computed.values, unit(stored.values)))
    index = np.empty((len(faces), 3), np.int64)
    for part in _chunks(len(faces)):
        normals = stored[part]
        outward = np.einsum("fki,fi->fk", normals, face_normals(vertices, faces[part]))
        fit = np.isfinite(normals).all(axis=2) & (outward > LEAST_COSINE * np.linalg.norm(normals, axis=2))
        index[part] = np.where(fit, stored.index[part] + len(computed.values), computed.index[part])
    return CornerValues(values, index)


def crease_length(vertices: Doubles, faces: Integers, normals: CornerValues) -> float:
    """Return the length of all creases: edges whose sides have different normals.

    vertices: (V, 3). faces: (F, 3). normals: unit vectors at the corners of faces.
    """
    first, second = edge_pairs(faces)
    one, other = (_index_at(normals, edges) for edges in (first, next_half_edges(second)))
    apart = one != other
    apart[apart] = np.einsum("ij,ij->i", normals.values[one[apart]], normals.values[other[apart]]) < CREASE_COSINE
    start = first[apart]
    corners = faces.ravel()
    along = vertices[corners[next_half_edges(start)]] - vertices[corners[start]]
    return float(np.linalg.norm(along, axis=1).sum())


def closed(faces: Integers) -> bool:
    """Whether every edge of faces (F, 3) belongs to exactly two of them."""
    keys = _edge_keys(faces)
    keys.sort()
    return len(keys) % 2 == 0 and bool((keys[::2] == keys[1::2]).all() and (keys[1:-1:2] != keys[2::2]).all())


def face_normals(vertices: Doubles, faces: Integers) -> Doubles:
    """Compute unit normals of faces (F, 3); zero for faces without area. vertices: (V, 3)."""
    return np.concatenate([unit(_cross(vertices, faces[part])) for part in _chunks(len(faces))])


def face_areas(vertices: Doubles, faces: Integers) -> Doubles:
    """Compute the areas (F,) of faces (F, 3). vertices: (V, 3)."""
    return np.concatenate([np.linalg.norm(_cross(vertices, faces[part]), axis=1) / 2 for part in _chunks(len(faces))])


def edge_pairs(faces: Integers) -> tuple[Integers, Integers]:
    """Pair the half edges that run along one edge in opposite directions, if exactly two faces share the edge.

    Half edge 3 f + k starts at corner k of face f. Returns the half edges of both sides, (E,) and (E,).
    """
    keys = _edge_keys(faces)
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    at = np.flatnonzero(np.concatenate(([True], keys[1:] != keys[:-1])))
    at = at[np.diff(at, append=len(keys)) == 2]
    first, second = order[at], order[at + 1]
    corners = faces.ravel()
    opposite = corners[first] == corners[next_half_edges(second)]
    return first[opposite], second[opposite]


def next_half_edges(half_edges: Integers) -> Integers:
    """Return the half edges (N,) that follow in the same faces; they start where the arguments end."""
    return np.asarray(half_edges - half_edges % 3 + (half_edges + 1) % 3)


def _smooth_groups(
    vertices: Doubles, faces: Integers, normals: Doubles, crease: float
) -> tuple[int, NDArray[np.signedinteger[Any]]]:
    """Group the corners of faces around each vertex, up to the next crease.

    normals: (F, 3), of the faces. Returns the number of groups, and each corner's group (F, 3).
    """
    first, second = edge_pairs(faces)
    smooth = ~_creases(vertices, faces, first, second, normals, crease)
    first, second = first[smooth], second[smooth]
    # A half edge and its opposite have their ends in opposite order.
    one = np.concatenate((first, next_half_edges(first)))
    other = np.concatenate((next_half_edges(second), second))
    links = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(faces.size, faces.size))
    groups, group = connected_components(links, directed=False)
    return groups, group.reshape(-1, 3)


def _creases(
    vertices: Doubles, faces: Integers, first: Integers, second: Integers, normals: Doubles, crease: float
) -> NDArray[np.bool_]:
    """Find the creases among the edges `first`, `second` (E,) of `edge_pairs`. Returns a mask (E,).

    An edge bends by the angle between its faces' normals. It is a crease if it bends by more than `crease` degrees and
    `SHARPER` times as much as the parallel edges beside it; a coarse round part fails this test, since its edges bend
    alike. Above `SHARP` degrees it always is a crease. normals: (F, 3), of the faces.
    """
    corners = faces.ravel()
    start, end = corners[first], corners[second]

    def directions(edges: Integers | slice) -> Doubles:
        return unit(vertices[end[edges]] - vertices[start[edges]])

    bend = np.empty(len(first))
    for part in _chunks(len(first)):
        one, other = normals[first[part] // 3], normals[second[part] // 3]
        across = np.einsum("ij,ij->i", np.cross(one, other), directions(part))
        bend[part] = np.arctan2(across, np.einsum("ij,ij->i", one, other))
    limit, sharp = np.radians((crease, max(crease, SHARP)))
    creases = np.abs(bend) > sharp
    unsure = np.flatnonzero((np.abs(bend) > limit) & ~creases)
    if not len(unsure):
        return np.asarray(creases)
    opposite = [corners[next_half_edges(next_half_edges(half_edge[unsure]))] for half_edge in (first, second)]
    marked = np.zeros(len(vertices), np.bool_)
    marked[np.concatenate(opposite)] = True
    near = np.flatnonzero(marked[start] | marked[end])
    at_vertex = coo_array(
        (np.ones(2 * len(near), np.int8), (np.concatenate((start[near], end[near])), np.tile(np.arange(len(near)), 2))),
        shape=(len(vertices), len(near)),
    ).tocsr()
    beside = np.zeros(len(unsure))
    for vertex in opposite:
        count = np.diff(at_vertex.indptr)[vertex]
        which = np.repeat(np.arange(len(unsure)), count)
        place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        other, mine = near[at_vertex.indices[at_vertex.indptr[vertex][which] + place]], unsure[which]
        touching = (
            (start[other] == start[mine])
            | (start[other] == end[mine])
            | (end[other] == start[mine])
            | (end[other] == end[mine])
        )
        along = np.abs(np.einsum("ij,ij->i", directions(other), directions(mine)))
        np.maximum.at(beside, which, np.where(touching, 0, along * bend[other] * np.sign(bend[mine])))
    creases[unsure] = np.abs(bend[unsure]) > SHARPER * beside
    return np.asarray(creases)


def corner_angles(vertices: Doubles, faces: Integers) -> Doubles:
    """Compute the angles (F, 3) of faces at their corners, radians."""
    corners = vertices[faces]
    forth = unit((np.roll(corners, -1, axis=1) - corners).reshape(-1, 3))
    back = unit((np.roll(corners, 1, axis=1) - corners).reshape(-1, 3))
    return np.asarray(np.arccos(np.clip(np.einsum("ij,ij->i", forth, back), -1, 1)).reshape(-1, 3))


def _index_at(values: CornerValues, half_edges: Integers) -> NDArray[np.signedinteger[Any]]:
    """Return the indices (N,) of the values at the starts of half edges (N,)."""
    return np.asarray(values.index[half_edges // 3, half_edges % 3])


def _edge_keys(faces: Integers) -> Integers:
    """Return a number for the edge of each half edge of faces (F, 3), equal for equal edges: (3 F,)."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    return np.asarray(np.minimum(start, end) * (int(faces.max()) + 1) + np.maximum(start, end))


def _chunks(count: int) -> Iterator[slice]:
    return (slice(at, at + CHUNK) for at in range(0, count, CHUNK))


def _cross(vertices: Doubles, faces: Integers) -> Doubles:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(np.cross(b - a, c - a))
