"""Cuts polygons into triangles: convex ones as fans, others by their ears."""

from contextlib import closing

import numpy as np

from .child import Child
from .frames import Arrays
from .values import Doubles, Integers

QUICK = 1 << 36
"""Largest sum of the cubes of the corners of polygons that are not convex, with which this process cuts them.

A spiral takes that time, here a tenth of a second; other polygons take less. Beyond, a child cuts them, within limits.
"""


def triangulated(vertices: Doubles, sizes: Integers, corners: Integers) -> tuple[Integers, Integers]:
    """Cut polygons into triangles.

    vertices: (V, 3). sizes: (P,), corners of each polygon. corners: (sum of sizes,), indices of vertices. Returns the
    triangles (F, 3), as places in `corners`, and the polygon (F,) of each. Polygons of fewer than three corners vanish.
    Raises UserError where that takes too long.
    """
    with closing(Child()) as child:
        return _cut(vertices, sizes, corners, child)


def _cut(vertices: Doubles, sizes: Integers, corners: Integers, child: Child) -> tuple[Integers, Integers]:
    """See `triangulated`. child: cuts what takes long."""
    work = 0
    starts = np.cumsum(sizes) - sizes
    triangles, owners = [], []
    by_size = np.argsort(sizes, kind="stable")
    for which in np.split(by_size, np.flatnonzero(np.diff(sizes[by_size])) + 1):
        size = int(sizes[which[0]]) if len(which) else 0
        if size < 3:
            continue
        places = starts[which, None] + np.arange(size)
        cut = places[:, _fan(size)]
        if size > 3 and len(concave := np.flatnonzero(_concave(vertices[corners[places]]))):
            work += len(concave) * size**3
            bent = vertices[corners[places[concave]]]
            made = ears(bent) if work <= QUICK else child.call(ears, ("mapbox_earcut",), bent.nbytes, polygons=bent)
            cut[concave] = np.take_along_axis(places[concave][:, None], made["triangles"], axis=2)
        triangles.append(cut.reshape(-1, 3))
        owners.append(np.repeat(which, size - 2))
    if not triangles:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order]


def _fan(size: int) -> Integers:
    """Return the triangles (N - 2, 3) of a polygon of N corners around its first one."""
    return np.stack((np.zeros(size - 2, np.int64), np.arange(1, size - 1), np.arange(2, size)), axis=1)


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


def ears(polygons: Doubles) -> Arrays:
    """Cut polygons (P, N, 3) by their ears; as fans, where they cross themselves. Returns "triangles" (P, N - 2, 3)."""
    return {"triangles": np.array([_ears(polygon) for polygon in polygons], np.int64).reshape(len(polygons), -1, 3)}


def _ears(polygon: Doubles) -> Integers:
    """Return the triangles (N - 2, 3) of one polygon (N, 3)."""
    from mapbox_earcut import triangulate_float64

    normal = _normals(polygon[None])[0]
    axis = int(np.abs(normal).argmax())
    flat = np.delete(polygon - polygon[0], axis, axis=1)
    cut = triangulate_float64(flat, np.array([len(flat)], np.uint32)).astype(np.int64).reshape(-1, 3)
    if len(cut) != len(polygon) - 2:
        return _fan(len(polygon))
    # The library's triangles have one orientation, whatever the polygon's.
    edges = flat[cut[:, 1:]] - flat[cut[:, :1]]
    area = float(np.linalg.det(edges).sum()) * (-1 if axis == 1 else 1)
    return cut if (area > 0) == (normal[axis] > 0) else cut[:, ::-1]
