"""The curved surface of a mesh: smooth across edges, except for creases.

Each triangle becomes a point-normal triangle (Vlachos et al. 2001, Curved PN Triangles): a cubic Bezier patch through
its corners that is perpendicular to their normals, subdivided into flat facets. Neighbors share the curve over their
common edge, so that no gap opens; the curve of a crease runs along both of its sides.
"""

from dataclasses import dataclass

import numpy as np

from ...readers.values import CornerValues
from .creases import Integers, corner_angles, edge_pairs, face_normals
from .shape import Doubles, unit

MOST_CUTS = 5  # most facets along an edge; they reduce the chord error of a triangle to a 25th
MOST_FACETS = 300_000  # meshes are subdivided up to this number of facets; finer scans are not subdivided
DECIMALS = 7  # positions and normals that agree to this number of decimals, in model space, are equal
CREASE_SINE_SQUARED = 0.03
"""An edge is a crease if the squared sine between the normals of both sides is larger: 10 degrees."""
ALONG = 0.5
"""Least cosine between a crease and the intersection of both sides' planes for its curve to follow that line."""


@dataclass(frozen=True, eq=False)
class Facets:
    """Flat triangles that approximate a surface, each cut from a face of a mesh."""

    vertices: Doubles
    """(V, 3)."""
    faces: Integers
    """(F, 3), indices of vertices."""
    normals: CornerValues
    """Outward normals of the surface at the corners of facets."""
    parents: Integers
    """(F,), indices of the mesh's faces that the facets were cut from."""
    weights: Doubles
    """(F, 3, 3), barycentric coordinates, in the parent, of each corner of a facet."""


def flat(vertices: Doubles, faces: Integers) -> Facets:
    """Use the faces (F, 3) of a mesh with vertices (V, 3) as facets."""
    index = np.broadcast_to(np.arange(len(faces))[:, None], faces.shape)
    return _uncut(vertices, faces, CornerValues(face_normals(vertices, faces), index))


def curved(vertices: Doubles, faces: Integers, normals: CornerValues) -> Facets:
    """Curve and subdivide a mesh; a fine mesh keeps its faces, with curved normals.

    vertices: (V, 3). faces: (F, 3). normals: at the corners of faces (creases.py).
    """
    cuts = int(np.clip(np.sqrt(MOST_FACETS / max(1, len(faces))), 1, MOST_CUTS))
    if cuts == 1:
        return _uncut(vertices, faces, normals)
    grid, small = cut_triangle(cuts)
    corners = normals[:]
    points = _patches(vertices[faces], _edge_points(vertices, faces, corners), grid)
    offsets = len(grid) * np.arange(len(faces))[:, None, None]
    vertices, facets = points.reshape(-1, 3), (small[None] + offsets).reshape(-1, 3)
    mixed = unit(np.einsum("mk,fki->fmi", grid, corners, optimize=True).reshape(-1, 3))
    return Facets(
        vertices=vertices,
        faces=facets,
        normals=_own_normals(vertices, facets, mixed),
        parents=np.repeat(np.arange(len(faces)), len(small)),
        weights=np.tile(grid[small], (len(faces), 1, 1)),
    )


def _uncut(vertices: Doubles, faces: Integers, normals: CornerValues) -> Facets:
    count = len(faces)
    return Facets(vertices, faces, normals, np.arange(count), np.broadcast_to(np.eye(3), (count, 3, 3)))


def _edge_points(vertices: Doubles, faces: Integers, normals: Doubles) -> Doubles:
    """Compute the inner two control points of the curve over each half edge, from its start to its end: (F, 3, 2, 3).

    A control point lies a third along the edge, projected into the tangent plane of the nearer end. At a crease, where
    both sides have different normals, it is projected onto the intersection of both planes.
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
    """Project edges (N, 3) into the plane of a normal (N, 3), or onto the intersection of the planes of two normals."""
    mean = unit(normals + across)
    in_plane = edges - np.einsum("ij,ij->i", edges, mean)[:, None] * mean
    line = np.cross(normals, across)
    creased = np.einsum("ij,ij->i", line, line) > CREASE_SINE_SQUARED
    line = unit(line)
    share = np.einsum("ij,ij->i", edges, line)
    creased &= np.abs(share) > ALONG * np.linalg.norm(edges, axis=1)
    return np.asarray(np.where(creased[:, None], share[:, None] * line, in_plane))


def cut_triangle(cuts: int) -> tuple[Doubles, Integers]:
    """Subdivide a triangle. Returns the vertices' barycentric coordinates (M, 3), and faces (cuts^2, 3)."""
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
    center = edge_points.mean(axis=(1, 2)) * 1.5 - corners.mean(axis=1) / 2
    controls = np.concatenate((corners, edge_points.reshape(-1, 6, 3), center[:, None]), axis=1)
    basis = np.stack(
        (
            *(u**3, v**3, w**3),
            *(3 * u * u * v, 3 * u * v * v, 3 * v * v * w, 3 * v * w * w, 3 * w * w * u, 3 * w * u * u),
            6 * u * v * w,
        )
    )
    return np.asarray(np.einsum("km,fki->fmi", basis, controls, optimize=True))


def _own_normals(vertices: Doubles, facets: Integers, mixed: Doubles) -> CornerValues:
    """Average facet normals around each position.

    The interpolated corner normals are not perpendicular to the patch, and a field cannot satisfy both. They only
    separate the two sides of a crease. vertices, mixed: (V, 3), positions and interpolated normals. facets: (F, 3).
    """
    places = np.round(np.concatenate((vertices, mixed), axis=1), DECIMALS)
    groups, group = np.unique(places, axis=0, return_inverse=True)
    corners = group.reshape(-1)[facets]
    sums = np.zeros((len(groups), 3))
    weighted = face_normals(vertices, facets)[:, None] * corner_angles(vertices, facets)[:, :, None]
    np.add.at(sums, corners, weighted)
    own = unit(sums)
    known = np.linalg.norm(own, axis=1) > 0.5
    index = np.where(known[corners], corners, len(own) + facets)
    return CornerValues(np.concatenate((own, mixed)), index)
