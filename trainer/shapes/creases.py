"""Normals at the corners of a mesh's faces: smooth across its edges, except for creases."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .shape import Doubles, unit

Whole = NDArray[np.int64]

PART = 1_000_000
"""Faces, or edges, that are worked on at once."""
ALONE = 2.5
"""A crease bends by so many times as much as the edges beside it."""
SHARP = 60.0
"""An edge that bends by more, in degrees, is a crease whatever is beside it: a cube, a nut."""
LEAST_COSINE = 0.2
"""A normal of a file is used where its angle to the face's has a larger cosine: it may be damaged, or point inwards."""


@dataclass(frozen=True, eq=False)
class CornerNormals:
    """Normals at the corners of faces. Each is kept once, since corners around a vertex mostly share theirs."""

    values: Doubles
    """(N, 3), of length one."""
    index: NDArray[np.signedinteger[Any]]
    """(F, 3), which of these each corner of a face has."""

    def __getitem__(self, faces: Whole | slice) -> Doubles:
        """Look up the normals at the corners of faces (M,): (M, 3, 3)."""
        return np.asarray(self.values[self.index[faces]])


def corner_normals(vertices: Doubles, faces: Whole, crease: float) -> CornerNormals:
    """Compute normals at the corners of faces: means over the faces around a vertex, up to the next crease.

    Means are weighted by the faces' angles at the vertex. vertices: (V, 3). faces: (F, 3). crease: the angle of
    `_creases`, degrees.
    """
    of_faces = face_normals(vertices, faces)
    groups, group = _smooth_groups(vertices, faces, of_faces, crease)
    sums = np.zeros((groups, 3))
    for part in _parts(len(faces)):
        weighted = of_faces[part, None] * corner_angles(vertices, faces[part])[:, :, None]
        at = group[part].ravel()
        for axis in range(3):
            sums[:, axis] += np.bincount(at, weighted[:, :, axis].ravel(), groups)
    values = unit(sums)
    opposed = np.flatnonzero((np.linalg.norm(values, axis=1) < 0.5)[group.ravel()])  # the faces' normals cancel
    if len(opposed):
        group.reshape(-1)[opposed] = groups + np.arange(len(opposed))
        values = np.concatenate((values, of_faces[opposed // 3]))
    return CornerNormals(values, group)


def usable_normals(vertices: Doubles, faces: Whole, given: CornerNormals, computed: CornerNormals) -> CornerNormals:
    """Take the normals that a file gives, but computed ones where these are no normals of their faces.

    vertices: (V, 3). faces: (F, 3). given: of any length. Returns the same, of length one.
    """
    values = np.concatenate((computed.values, unit(given.values)))
    index = np.empty((len(faces), 3), np.int64)
    for part in _parts(len(faces)):
        there = given[part]
        outward = np.einsum("fki,fi->fk", there, face_normals(vertices, faces[part]))
        fit = np.isfinite(there).all(axis=2) & (outward > LEAST_COSINE * np.linalg.norm(there, axis=2))
        index[part] = np.where(fit, given.index[part] + len(computed.values), computed.index[part])
    return CornerNormals(values, index)


def closed(faces: Whole) -> bool:
    """Tell whether every edge of faces (F, 3) is one of exactly two of them."""
    keys = _edge_keys(faces)
    keys.sort()
    return len(keys) % 2 == 0 and bool((keys[::2] == keys[1::2]).all() and (keys[1:-1:2] != keys[2::2]).all())


def face_normals(vertices: Doubles, faces: Whole) -> Doubles:
    """Compute the normals of faces (F, 3), of length one; zero where a face has no area. vertices: (V, 3)."""
    return np.concatenate([unit(_cross(vertices, faces[part])) for part in _parts(len(faces))])


def face_areas(vertices: Doubles, faces: Whole) -> Doubles:
    """Compute the areas of faces, (F,). vertices: (V, 3). faces: (F, 3)."""
    return np.concatenate([np.linalg.norm(_cross(vertices, faces[part]), axis=1) / 2 for part in _parts(len(faces))])


def edge_pairs(faces: Whole) -> tuple[Whole, Whole]:
    """Pair the half edges of faces that run along one edge in opposite directions; edges of other faces are left out.

    Returns their numbers, 3 f + k for the one that leaves corner k of face f: (E,) and (E,).
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


def next_half_edges(half_edges: Whole) -> Whole:
    """Return the half edges that follow (N,) in their faces: their numbers are those of the end corners, too."""
    return np.asarray(half_edges - half_edges % 3 + (half_edges + 1) % 3)


def _smooth_groups(
    vertices: Doubles, faces: Whole, normals: Doubles, crease: float
) -> tuple[int, NDArray[np.signedinteger[Any]]]:
    """Group the corners of faces around each vertex, up to the next crease: the groups' number, and each corner's.

    normals: (F, 3), of the faces. Returns (F, 3).
    """
    first, second = edge_pairs(faces)
    smooth = ~_creases(vertices, faces, first, second, normals, crease)
    first, second = first[smooth], second[smooth]
    # Half edge 3 f + k runs from corner k to corner k + 1 of face f; across it, the ends come in the opposite order.
    one = np.concatenate((first, next_half_edges(first)))
    other = np.concatenate((next_half_edges(second), second))
    links = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(faces.size, faces.size))
    groups, group = connected_components(links, directed=False)
    return groups, group.reshape(-1, 3)


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

    def directions(edges: Whole | slice) -> Doubles:
        return unit(vertices[end[edges]] - vertices[start[edges]])

    bend = np.empty(len(first))
    for part in _parts(len(first)):
        one, other = normals[first[part] // 3], normals[second[part] // 3]
        across = np.einsum("ij,ij->i", np.cross(one, other), directions(part))
        bend[part] = np.arctan2(across, np.einsum("ij,ij->i", one, other))
    limit, sharp = np.radians((crease, max(crease, SHARP)))
    creases = np.abs(bend) > sharp
    unsure = np.flatnonzero((np.abs(bend) > limit) & ~creases)
    if not len(unsure):
        return np.asarray(creases)
    opposite = [corners[next_half_edges(next_half_edges(half_edge[unsure]))] for half_edge in (first, second)]
    asked = np.zeros(len(vertices), np.bool_)
    asked[np.concatenate(opposite)] = True
    near = np.flatnonzero(asked[start] | asked[end])
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
        touching = _share_an_end(start, end, other, mine)
        along = np.abs(np.einsum("ij,ij->i", directions(other), directions(mine)))
        np.maximum.at(beside, which, np.where(touching, 0, along * bend[other] * np.sign(bend[mine])))
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


def _edge_keys(faces: Whole) -> Whole:
    """Number the edges that the half edges of faces (F, 3) run along: (3 F,), equal for equal edges."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    return np.asarray(np.minimum(start, end) * (int(faces.max()) + 1) + np.maximum(start, end))


def _parts(count: int) -> Iterator[slice]:
    """Divide `count` rows into parts whose intermediate results fit the memory."""
    return (slice(at, at + PART) for at in range(0, count, PART))


def _cross(vertices: Doubles, faces: Whole) -> Doubles:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(np.cross(b - a, c - a))
