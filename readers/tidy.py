"""Tidies a mesh: merges vertices at one place, and drops faces that are no faces or are there twice."""

from dataclasses import replace

import numpy as np

from .content import Mesh
from .values import Integers

EQUAL = 1e-8  # vertices closer than this share of the mesh's size are one


def tidy(mesh: Mesh) -> Mesh:
    """Merge vertices that share a place, and drop degenerate faces and all but one of faces with the same corners.

    Colors, normals and texture coordinates stay at the corners of the faces. Of two faces with opposite sides, the
    first stays: the mesh was stored with both sides.
    """
    vertices, faces = mesh.vertices, mesh.faces
    used, inverse = np.unique(faces, return_inverse=True)
    points = vertices[used]
    if len(points):
        size = float(np.ptp(points, axis=0).max()) or 1.0
        cells = np.round((points - points.min(axis=0)) / (size * EQUAL)).astype(np.int64)
        first, group = _groups(cells)
        points, faces = points[first], group[inverse.reshape(faces.shape)]
    merged = replace(mesh, vertices=points, faces=faces)
    kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    kept[_repeated(faces)] = False
    return merged if kept.all() or not kept.any() else merged.take(kept)


def _groups(cells: Integers) -> tuple[Integers, Integers]:
    """Group equal rows of (N, 3). Returns the first row (G,) of each group, in order, and each row's group (N,)."""
    key = np.zeros(len(cells), np.int64)
    for column in cells.T:  # three sorts of numbers are faster than one of rows
        values, place = np.unique(column, return_inverse=True)
        key = np.unique(key * len(values) + place.ravel(), return_inverse=True)[1].ravel()
    _, first = np.unique(key, return_index=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[key]


def _repeated(faces: Integers) -> Integers:
    """Return the indices of the faces whose corners are, in any order, those of an earlier face."""
    if not len(faces):
        return np.zeros(0, np.int64)
    corners = np.sort(faces, axis=1)
    order = np.lexsort((np.arange(len(faces)), *corners.T[::-1]))
    same = (corners[order][1:] == corners[order][:-1]).all(axis=1)
    return np.asarray(order[1:][same])
