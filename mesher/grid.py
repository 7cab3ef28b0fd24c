"""The grid that a surface is extracted on, and the set of its cells that the surface passes."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surface import Array, Whole

EXTENT = 1.02
"""Radius of the ball in which the surface is looked for, and half the side of the grid's cube around it, model units.

The shape fits the unit sphere, and its surface may bulge a little out of it. Farther out, towards the corners of the
domain, level 1 may have surfaces that mean nothing; rays of the viewer end in a ball as well and do not meet them.
"""
SNAP = 1e-3
"""Smallest |value| at a vertex, in sides of a cell: a surface through a vertex would have triangles without area."""
CORNERS = np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 1, 1], [0, 1, 0], [1, 1, 0], [1, 1, 1]])
"""Places of a cell's 8 corners, (x, y, z) in cells, in the order in which libigl's marching cubes wants them."""


class Grid:
    """A grid of resolution^3 cells over the cube [-EXTENT, EXTENT]^3.

    A vertex is named by one whole number, its key, in which x counts slowest; a cell has the key of its lowest corner.
    """

    def __init__(self, resolution: int) -> None:
        """Lay out a grid with `resolution` cells along each side."""
        self.resolution = resolution
        self.side = 2 * EXTENT / resolution
        self.diagonal = math.sqrt(3) * self.side
        stride = resolution + 2  # One more than there are vertices: a block of 2^3 cells may stand out by a cell.
        self.steps = np.array([stride**2, stride, 1])
        self.corners: Whole = CORNERS @ self.steps

    def indices(self, keys: Whole) -> Whole:
        """Return the places (N, 3), (x, y, z) in cells, of keys (N,)."""
        return np.asarray(keys[:, None] // self.steps % self.steps[1])

    def positions(self, keys: Whole) -> NDArray[np.float64]:
        """Return the positions (N, 3), model space, of vertices with keys (N,)."""
        return np.asarray(self.side * self.indices(keys) - EXTENT, np.float64)

    def closed(self, positions: NDArray[np.float64], values: Array) -> Array:
        """Change a field's values so that marching cubes gives a closed surface without degenerate triangles.

        positions: of vertices (N, 3). values: (N,) at them. Outside the ball of radius EXTENT no value stays negative,
        and none is nearer to zero than SNAP sides of a cell.
        """
        outside = np.linalg.norm(positions, axis=1).astype(np.float32) - np.float32(EXTENT)
        values, least = np.maximum(values, outside), np.float32(SNAP * self.side)
        return np.where(np.abs(values) < least, np.where(outside < -least, np.copysign(least, values), least), values)


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a grid that have corners of both signs, and the vertices at their corners."""

    cells: Whole
    """(C,) keys of cells, sorted."""
    corners: Whole
    """(C, 8) the cells' corners, as places in `keys`, in the order of CORNERS."""
    keys: Whole
    """(K,) keys of vertices, sorted."""
    values: Array
    """(K,) the field's values at the vertices."""


def crossed(cells: Whole, corners: Whole, values: Array) -> tuple[Whole, Whole]:
    """Select the cells whose corners have values of both signs.

    cells: (N,) keys. corners: (N, 8) places in `values`. Returns the selected rows of both.
    """
    count = np.count_nonzero(values[corners] < 0, axis=1)
    mixed = (count > 0) & (count < 8)
    return cells[mixed], corners[mixed]


def compact(cells: Whole, corners: Whole, keys: Whole, values: Array) -> Cells:
    """Make a `Cells`: sort the cells, and leave out vertices that are no corner of any of them."""
    used = np.zeros(len(keys), bool)
    used[corners] = True
    order = np.argsort(cells)
    return Cells(cells[order], (np.cumsum(used) - 1)[corners[order]], keys[used], values[used])


def joined(parts: list[Cells]) -> Cells:
    """Join the cells of all parts, which have no cell in common but may have vertices in common."""
    keys, first = np.unique(np.concatenate([part.keys for part in parts]), return_index=True)
    values = np.concatenate([part.values for part in parts])[first]
    corners = np.concatenate([np.searchsorted(keys, part.keys)[part.corners] for part in parts])
    return compact(np.concatenate([part.cells for part in parts]), corners, keys, values)


def lattice(x: int, y: int, z: int) -> Whole:
    """List the points (i, j, k) with 0 <= i < x, 0 <= j < y, 0 <= k < z, k fastest: (x y z, 3)."""
    return np.argwhere(np.ones((x, y, z), np.bool_))


def sorted_unique(keys: Whole) -> Whole:
    """Return keys in order, each once: (M,). For integers this is faster than `np.unique`."""
    keys = np.sort(keys.ravel())
    first = np.ones(len(keys), np.bool_)
    first[1:] = keys[1:] != keys[:-1]
    return np.asarray(keys[first])
