"""The grid of marching cubes, and the set of its cells that the surface crosses."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surface import Array, Whole

EXTENT = 1.02
"""Radius of the ball that holds the surface, and half the side of the grid's cube, model units.

The shape fits the unit sphere; its learned surface may bulge out a little. Farther out, in the corners of the domain,
level 1 may have spurious surfaces. The viewer's rays end in a ball, too.
"""
SNAP = 1e-3
"""Smallest |value| at a vertex, in sides of a cell: a surface through a vertex would have degenerate triangles."""
CORNERS = np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 1, 1], [0, 1, 0], [1, 1, 0], [1, 1, 1]])
"""(8, 3) corners (x, y, z) of a cell, in cells, in the order of libigl's marching cubes."""


class Grid:
    """A grid of resolution^3 cells over the cube [-EXTENT, EXTENT]^3.

    A vertex has an integer key, in which x varies slowest. A cell has the key of its lowest corner.
    """

    def __init__(self, resolution: int) -> None:
        """resolution: cells along each side."""
        self.resolution = resolution
        self.side = 2 * EXTENT / resolution
        self.diagonal = math.sqrt(3) * self.side
        stride = resolution + 2  # One more than the vertices: a block of 2^3 cells may extend one cell beyond the grid.
        self.steps = np.array([stride**2, stride, 1])
        self.corners: Whole = CORNERS @ self.steps

    def indices(self, keys: Whole) -> Whole:
        """Return the indices (N, 3), (x, y, z), of keys (N,)."""
        return np.asarray(keys[:, None] // self.steps % self.steps[1])

    def positions(self, keys: Whole) -> NDArray[np.float64]:
        """Return the positions (N, 3), model space, of vertices with keys (N,)."""
        return np.asarray(self.side * self.indices(keys) - EXTENT, np.float64)

    def closed(self, positions: NDArray[np.float64], values: Array) -> Array:
        """Change the values of a field so that marching cubes makes a closed surface without degenerate triangles.

        positions: (N, 3) vertices. values: (N,). Returns values that are positive outside the ball of radius EXTENT,
        and at least SNAP sides of a cell from zero.
        """
        outside = np.linalg.norm(positions, axis=1).astype(np.float32) - np.float32(EXTENT)
        values, least = np.maximum(values, outside), np.float32(SNAP * self.side)
        return np.where(np.abs(values) < least, np.where(outside < -least, np.copysign(least, values), least), values)


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a grid with corners of both signs, and their vertices."""

    cells: Whole
    """(C,) sorted keys of cells."""
    corners: Whole
    """(C, 8) corners of the cells, as indices into `keys`, in the order of CORNERS."""
    keys: Whole
    """(K,) sorted keys of vertices."""
    values: Array
    """(K,) values of the field at the vertices."""


def crossed(cells: Whole, corners: Whole, values: Array) -> tuple[Whole, Whole]:
    """Select the cells with corners of both signs.

    cells: (N,) keys. corners: (N, 8) indices into `values`. Returns the selected rows of both.
    """
    count = np.count_nonzero(values[corners] < 0, axis=1)
    mixed = (count > 0) & (count < 8)
    return cells[mixed], corners[mixed]


def compact(cells: Whole, corners: Whole, keys: Whole, values: Array) -> Cells:
    """Make a `Cells`: sort the cells, and drop vertices that are no corner of a cell."""
    used = np.zeros(len(keys), bool)
    used[corners] = True
    order = np.argsort(cells)
    return Cells(cells[order], (np.cumsum(used) - 1)[corners[order]], keys[used], values[used])


def joined(parts: list[Cells]) -> Cells:
    """Join parts that share no cell but may share vertices."""
    keys, first = np.unique(np.concatenate([part.keys for part in parts]), return_index=True)
    values = np.concatenate([part.values for part in parts])[first]
    corners = np.concatenate([np.searchsorted(keys, part.keys)[part.corners] for part in parts])
    return compact(np.concatenate([part.cells for part in parts]), corners, keys, values)


def lattice(x: int, y: int, z: int) -> Whole:
    """List the points (i, j, k) with 0 <= i < x, 0 <= j < y, 0 <= k < z, k fastest: (x y z, 3)."""
    return np.argwhere(np.ones((x, y, z), np.bool_))


def sorted_unique(keys: Whole) -> Whole:
    """Return the sorted unique keys: (M,). For integers this is faster than `np.unique`."""
    keys = np.sort(keys.ravel())
    first = np.ones(len(keys), np.bool_)
    first[1:] = keys[1:] != keys[:-1]
    return np.asarray(keys[first])
