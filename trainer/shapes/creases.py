"""Normals at the corners of a mesh's faces: smooth across its edges, except for creases."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .shape import Doubles, unit

Whole = NDArray[np.int64]

ALONE = 2.5
"""A crease bends by so many times as much as the edges beside it."""
SHARP = 60.0
"""An edge that bends by more, in degrees, is a crease whatever is beside it: a cube, a nut."""
LEAST_COSINE = 0.2
"""A normal of a file is used where its angle to the face's has a larger cosine: it may be damaged, or point inwards."""


def corner_normals(vertices: Doubles, faces: Whole, crease: float) -> Doubles:
    """Compute normals at the corners of faces: means over the faces around a vertex, up to the next crease.

    Means are weighted by the faces' angles at the vertex. vertices: (V, 3). faces: (F, 3). crease: the angle of
    `_creases`, degrees. Returns (F, 3, 3), of length one.
    """
    of_faces = face_normals(vertices, faces)
    count = faces.size
    first, second = edge_pairs(faces)
    smooth = ~_creases(vertices, faces, first, second, of_faces, crease)
    first, second = first[smooth], second[smooth]
    # Half edge 3 f + k runs from corner k to corner k + 1 of face f; across it, the ends come in the opposite order.
    one = np.concatenate((first, next_half_edges(first)))
    other = np.concatenate((next_half_edges(second), second))
    links = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(count, count))
    groups, group = connected_components(links, directed=False)
    sums = np.zeros((groups, 3))
    np.add.at(sums, group, (of_faces[:, None] * corner_angles(vertices, faces)[:, :, None]).reshape(-1, 3))
    normals = unit(sums)[group].reshape(-1, 3, 3)
    return np.asarray(np.where(np.linalg.norm(normals, axis=2, keepdims=True) > 0.5, normals, of_faces[:, None]))


def usable_normals(vertices: Doubles, faces: Whole, given: Doubles, computed: Doubles) -> Doubles:
    """Take the normals that a file gives, but computed ones where these are no normals of their faces.

    vertices: (V, 3). faces: (F, 3). given, computed: (F, 3, 3), at the faces' corners.
    Returns the same, of length one.
    """
    outward = np.einsum("fki,fi->fk", given, face_normals(vertices, faces))
    fit = np.isfinite(given).all(axis=2) & (outward > LEAST_COSINE * np.linalg.norm(given, axis=2))
    return np.asarray(np.where(fit[:, :, None], unit(given.reshape(-1, 3)).reshape(given.shape), computed))


def face_normals(vertices: Doubles, faces: Whole) -> Doubles:
    """Compute the normals of faces (F, 3), of length one; zero where a face has no area. vertices: (V, 3)."""
    return unit(_cross(vertices, faces))


def face_areas(vertices: Doubles, faces: Whole) -> Doubles:
    """Compute the areas of faces, (F,). vertices: (V, 3). faces: (F, 3)."""
    return np.asarray(np.linalg.norm(_cross(vertices, faces), axis=1) / 2)


def edge_pairs(faces: Whole) -> tuple[Whole, Whole]:
    """Pair the half edges of faces that run along one edge in opposite directions; edges of other faces are left out.

    Returns their numbers, 3 f + k for the one that leaves corner k of face f: (E,) and (E,).
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end) * (int(faces.max()) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    _, at, count = np.unique(key[order], return_index=True, return_counts=True)
    first, second = order[at[count == 2]], order[at[count == 2] + 1]
    opposite = start[first] == end[second]
    return first[opposite], second[opposite]


def next_half_edges(half_edges: Whole) -> Whole:
    """Return the half edges that follow (N,) in their faces: their numbers are those of the end corners, too."""
    return np.asarray(half_edges - half_edges % 3 + (half_edges + 1) % 3)


def _creases(
    vertices: Doubles, faces: Whole, first: Whole, second: Whole, normals: Doubles, crease: float
) -> NDArray[np.bool_]:
    """Tell which of the edges `first`, `second` (E,) of `edge_pairs` are creases, (E,).

    An edge bends by the angle between the normals of its faces. It is a crease where it bends by more than `crease`
    degrees, and by `ALONE` times as much as the edges beside it that run along it: those of a round part that is cut
    coarsely bend alike. From `SHARP` on it is a crease at any rate. normals: (F, 3), of the faces.
    """
    corners = faces.ravel()
    start, end = corners[first], corners[second]
    direction = unit(vertices[end] - vertices[start])
    across = np.cross(normals[first // 3], normals[second // 3])
    bend = np.arctan2(
        np.einsum("ij,ij->i", across, direction), np.einsum("ij,ij->i", normals[first // 3], normals[second // 3])
    )
    limit, sharp = np.radians((crease, max(crease, SHARP)))
    creases = np.abs(bend) > sharp
    unsure = np.flatnonzero((np.abs(bend) > limit) & ~creases)
    at_vertex = coo_array(
        (np.ones(2 * len(bend), np.int8), (np.concatenate((start, end)), np.tile(np.arange(len(bend)), 2))),
        shape=(len(vertices), len(bend)),
    ).tocsr()
    beside = np.zeros(len(unsure))
    for half_edge in (first, second):
        opposite = corners[next_half_edges(next_half_edges(half_edge[unsure]))]
        count = np.diff(at_vertex.indptr)[opposite]
        which = np.repeat(np.arange(len(unsure)), count)
        place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        other, mine = at_vertex.indices[at_vertex.indptr[opposite][which] + place], unsure[which]
        touching = _share_an_end(start, end, other, mine)
        alike = np.abs(np.einsum("ij,ij->i", direction[other], direction[mine])) * bend[other] * np.sign(bend[mine])
        np.maximum.at(beside, which, np.where(touching, 0, alike))
    creases[unsure] = np.abs(bend[unsure]) > ALONE * beside
    return np.asarray(creases)


def _share_an_end(start: Whole, end: Whole, one: Whole, other: Whole) -> NDArray[np.bool_]:
    """Tell which of the edges `one` (N,) have an end in common with those of `other` (N,)."""
    return np.asarray(
        (start[one] == start[other])
        | (start[one] == end[other])
        | (end[one] == start[other])
        | (end[one] == end[other])
    )


def corner_angles(vertices: Doubles, faces: Whole) -> Doubles:
    """Compute the angles of faces at their corners, radians (F, 3)."""
    corners = vertices[faces]
    forth = unit((np.roll(corners, -1, axis=1) - corners).reshape(-1, 3))
    back = unit((np.roll(corners, 1, axis=1) - corners).reshape(-1, 3))
    return np.asarray(np.arccos(np.clip(np.einsum("ij,ij->i", forth, back), -1, 1)).reshape(-1, 3))


def _cross(vertices: Doubles, faces: Whole) -> Doubles:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(np.cross(b - a, c - a))
