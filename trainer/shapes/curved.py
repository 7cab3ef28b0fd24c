"""The curved surface that a mesh stands for: smooth across its edges, except for creases.

Each triangle becomes a point-normal triangle (Vlachos et al. 2001, Curved PN Triangles), a cubic Bezier patch over its
corners that meets their normals, cut into small triangles. Neighbours share the curve over their common edge, so that
no gap opens; a crease's curve runs along both of its sides.
"""

from dataclasses import dataclass

import numpy as np

from .creases import CornerNormals, Whole, corner_angles, edge_pairs, face_normals
from .shape import Doubles, unit

MOST_CUTS = 5
"""Most small triangles along an edge: the chord errors of a patch fall to a 25th of the facet's."""
MOST_FACES = 300_000
"""A mesh is cut into at most so many small triangles, or not at all: scans are fine enough as they are."""
DECIMALS = 7
"""Places and normals that agree to so many digits after the point, in model space, are one."""
CREASED = 0.03
"""Squared sine of the angle between the normals on both sides of an edge, from which on it is a crease: 10 degrees."""
ALONG = 0.5
"""Least cosine between a crease and the line that the planes on both sides share, for its curve to follow that line."""


@dataclass(frozen=True, eq=False)
class Facets:
    """The small flat triangles that a surface is made of, each cut from a face of a mesh."""

    vertices: Doubles
    """(V, 3)."""
    faces: Whole
    """(F, 3), numbers of vertices."""
    normals: CornerNormals
    """Of the surface, outward, at each corner of a facet."""
    parents: Whole
    """(F,), numbers of the mesh's faces that the facets were cut from."""
    weights: Doubles
    """(F, 3, 3): barycentric coordinates, in the parent, of each corner of a facet."""


def flat(vertices: Doubles, faces: Whole) -> Facets:
    """Take the faces of a mesh as they are. vertices: (V, 3). faces: (F, 3)."""
    return _uncut(
        vertices, faces, CornerNormals(face_normals(vertices, faces), np.broadcast_to(_numbers(faces), faces.shape))
    )


def curved(vertices: Doubles, faces: Whole, normals: CornerNormals) -> Facets:
    """Curve and cut a mesh; of one that is fine enough only the normals are those of a curved surface.

    vertices: (V, 3). faces: (F, 3). normals: at the faces' corners (creases.py).
    """
    cuts = int(np.clip(np.sqrt(MOST_FACES / max(1, len(faces))), 1, MOST_CUTS))
    if cuts == 1:
        return _uncut(vertices, faces, normals)
    grid, small = cut_triangle(cuts)
    corners = normals[:]
    points = _patches(vertices[faces], _edge_points(vertices, faces, corners), grid)
    vertices, facets = points.reshape(-1, 3), (small[None] + len(grid) * _numbers(faces)[:, None]).reshape(-1, 3)
    return Facets(
        vertices=vertices,
        faces=facets,
        normals=_own_normals(vertices, facets, _turned(corners, grid).reshape(-1, 3)),
        parents=np.repeat(np.arange(len(faces)), len(small)),
        weights=np.tile(grid[small], (len(faces), 1, 1)),
    )


def _uncut(vertices: Doubles, faces: Whole, normals: CornerNormals) -> Facets:
    """Take the faces of a mesh with normals of another surface."""
    count = len(faces)
    return Facets(vertices, faces, normals, np.arange(count), np.broadcast_to(np.eye(3), (count, 3, 3)))


def _numbers(faces: Whole) -> Whole:
    """Number faces (F, 3): (F, 1)."""
    return np.arange(len(faces))[:, None]


def _edge_points(vertices: Doubles, faces: Whole, normals: Doubles) -> Doubles:
    """Compute the inner two control points of the curve over each half edge: (F, 3, 2, 3), from its start to its end.

    A control point is a third along the edge, moved into the plane of the normal at the end that it is near to. At a
    crease, where the two sides have different normals, it is moved onto the line that both planes share.
    """
    starts = vertices[faces].reshape(-1, 3)
    ends = np.roll(vertices[faces], -1, axis=1).reshape(-1, 3)
    at_start, at_end = normals.reshape(-1, 3), np.roll(normals, -1, axis=1).reshape(-1, 3)
    across_start, across_end = at_start.copy(), at_end.copy()
    first, second = edge_pairs(faces)
    for mine, theirs in ((first, second), (second, first)):
        across_start[mine], across_end[mine] = at_end[theirs], at_start[theirs]
    near_start = starts + _tangential(ends - starts, at_start, across_start) / 3
    near_end = ends + _tangential(starts - ends, at_end, across_end) / 3
    return np.stack((near_start, near_end), axis=1).reshape(-1, 3, 2, 3)


def _tangential(edges: Doubles, normals: Doubles, across: Doubles) -> Doubles:
    """Project edges (N, 3) into the plane of a normal (N, 3), or on the line that is in the planes of two."""
    mean = unit(normals + across)
    in_plane = edges - np.einsum("ij,ij->i", edges, mean)[:, None] * mean
    line = np.cross(normals, across)
    creased = np.einsum("ij,ij->i", line, line) > CREASED
    line = unit(line)
    share = np.einsum("ij,ij->i", edges, line)
    creased &= np.abs(share) > ALONG * np.linalg.norm(edges, axis=1)
    return np.asarray(np.where(creased[:, None], share[:, None] * line, in_plane))


def cut_triangle(cuts: int) -> tuple[Doubles, Whole]:
    """Cut a triangle into cuts^2 small ones: barycentric coordinates of the vertices (M, 3), and faces (cuts^2, 3)."""
    numbers = dict[tuple[int, int], int]()
    places = list[tuple[int, int, int]]()
    for i in range(cuts + 1):
        for j in range(cuts + 1 - i):
            numbers[i, j] = len(places)
            places.append((cuts - i - j, i, j))
    small = [(numbers[i, j], numbers[i + 1, j], numbers[i, j + 1]) for i, j in numbers if i + j < cuts]
    small += [(numbers[i + 1, j], numbers[i + 1, j + 1], numbers[i, j + 1]) for i, j in numbers if i + j < cuts - 1]
    return np.array(places, np.float64) / cuts, np.array(small, np.int64)


def _patches(corners: Doubles, edge_points: Doubles, grid: Doubles) -> Doubles:
    """Evaluate cubic triangles at barycentric coordinates.

    corners: (F, 3, 3). edge_points: (F, 3, 2, 3), of `_edge_points`. grid: (M, 3). Returns (F, M, 3).
    """
    u, v, w = grid.T
    centre = edge_points.mean(axis=(1, 2)) * 1.5 - corners.mean(axis=1) / 2
    controls = np.concatenate((corners, edge_points.reshape(-1, 6, 3), centre[:, None]), axis=1)
    basis = np.stack(
        (
            *(u**3, v**3, w**3),
            *(3 * u * u * v, 3 * u * v * v, 3 * v * v * w, 3 * v * w * w, 3 * w * w * u, 3 * w * u * u),
            6 * u * v * w,
        )
    )
    return np.asarray(np.einsum("km,fki->fmi", basis, controls, optimize=True))


def _turned(normals: Doubles, grid: Doubles) -> Doubles:
    """Interpolate the normals of corners (F, 3, 3) at barycentric coordinates (M, 3): (F, M, 3), of length one."""
    mixed = np.einsum("mk,fki->fmi", grid, normals, optimize=True)
    return unit(mixed.reshape(-1, 3)).reshape(mixed.shape)


def _own_normals(vertices: Doubles, facets: Whole, turned: Doubles) -> CornerNormals:
    """Compute the patches' own normals at the corners of facets, as means over the facets around a place.

    Those interpolated between corners are none of the patch's: a field cannot have both. They only tell the sides of a
    crease apart. vertices, turned: (V, 3), places and interpolated normals. facets: (F, 3).
    """
    places = np.round(np.concatenate((vertices, turned), axis=1), DECIMALS)
    groups, group = np.unique(places, axis=0, return_inverse=True)
    corners = group.reshape(-1)[facets]
    sums = np.zeros((len(groups), 3))
    weighted = face_normals(vertices, facets)[:, None] * corner_angles(vertices, facets)[:, :, None]
    np.add.at(sums, corners, weighted)
    own = unit(sums)
    known = np.linalg.norm(own, axis=1) > 0.5
    index = np.where(known[corners], corners, len(own) + facets)
    return CornerNormals(np.concatenate((own, turned)), index)
