"""Cuts polygons into triangles: convex ones as fans, others by their ears."""

import numpy as np

from ..model.errors import UserError
from .values import Doubles, Integers

MOST_WORK = 1 << 41
"""Largest sum of the cubes of the corners of polygons that are not convex: a spiral takes that time, here some seconds.

One polygon may have 13,000 corners."""


def triangulated(vertices: Doubles, sizes: Integers, corners: Integers) -> tuple[Integers, Integers]:
    """Cut polygons into triangles.

    vertices: (V, 3). sizes: (P,), corners of each polygon. corners: (sum of sizes,), indices of vertices. Returns the
    triangles (F, 3), as places in `corners`, and the polygon (F,) of each. Polygons of fewer than three corners vanish.
    Raises UserError where that takes too long.
    """
    work = 0
    starts = np.cumsum(sizes) - sizes
    triangles, owners = [], []
    by_size = np.argsort(sizes, kind="stable")
    for which in np.split(by_size, np.flatnonzero(np.diff(sizes[by_size])) + 1):
        size = int(sizes[which[0]]) if len(which) else 0
        if size < 3:
            continue
        places = starts[which, None] + np.arange(size)
        fan = np.stack((np.zeros(size - 2, np.int64), np.arange(1, size - 1), np.arange(2, size)), axis=1)
        cut = places[:, fan]
        if size > 3:
            concave = np.flatnonzero(_concave(vertices[corners[places]]))
            work += len(concave) * size**3
            if work > MOST_WORK:
                raise UserError(f"polygons of up to {size:,} corners that are not convex; triangulate the mesh")
            for row in concave:
                cut[row] = places[row][_ears(vertices[corners[places[row]]], fan)]
        triangles.append(cut.reshape(-1, 3))
        owners.append(np.repeat(which, size - 2))
    if not triangles:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order]


def _normals(polygons: Doubles) -> Doubles:
    """Return the area vectors (P, 3) of polygons (P, N, 3)."""
    centered = polygons - polygons[:, :1]
    return np.asarray(np.cross(centered, np.roll(centered, -1, axis=1)).sum(axis=1))


def _concave(polygons: Doubles) -> np.typing.NDArray[np.bool_]:
    """Find the polygons (P, N, 3) for which a fan from the first corner has a triangle that faces backwards."""
    centered = polygons - polygons[:, :1]
    fans = np.cross(centered[:, 1:-1], centered[:, 2:])
    facing = np.einsum("pni,pi->pn", fans, _normals(polygons))
    return np.asarray((facing < -1e-9 * np.abs(facing).max(axis=1, keepdims=True)).any(axis=1))


def _ears(polygon: Doubles, fan: Integers) -> Integers:
    """Cut one polygon (N, 3) by its ears; the fan, where it crosses itself. Returns triangles (N - 2, 3)."""
    from mapbox_earcut import triangulate_float64

    normal = _normals(polygon[None])[0]
    axis = int(np.abs(normal).argmax())
    flat = np.delete(polygon - polygon[0], axis, axis=1)
    cut = triangulate_float64(flat, np.array([len(flat)], np.uint32)).astype(np.int64).reshape(-1, 3)
    if len(cut) != len(fan):
        return fan
    # The library's triangles have one orientation, whatever the polygon's.
    edges = flat[cut[:, 1:]] - flat[cut[:, :1]]
    area = float(np.linalg.det(edges).sum()) * (-1 if axis == 1 else 1)
    return cut if (area > 0) == (normal[axis] > 0) else cut[:, ::-1]
