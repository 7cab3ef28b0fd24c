"""The grid that a surface is extracted on, and its cells that the surface passes."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surface import Array, Whole

EXTENT = 1.02
"""Radius of the ball that the surface is looked for in, and half side of the grid's cube around it.

The shape fits the unit sphere, and its surface may bulge a little over it. Far outside, towards the corners of the
domain, level 1 may have surfaces that no ray of the viewer meets either: it looks into a ball as well.
"""
SNAP = 1e-3
"""Least |value| at a grid vertex, in cell sides: a surface through a vertex would give triangles without area."""
CORNERS = np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 1, 1], [0, 1, 0], [1, 1, 0], [1, 1, 1]])
"""A cell's corners, (x, y, z), in the order in which libigl's marching cubes wants them."""


class Grid:
    """resolution^3 cells over [-EXTENT, EXTENT]^3.

    A vertex is known by one number, its key, x slowest; a cell by that of its lowest corner.
    """

    def __init__(self, resolution: int) -> None:
        self.resolution = resolution
        self.side = 2 * EXTENT / resolution
        self.diagonal = math.sqrt(3) * self.side
        stride = resolution + 2  # one more than there are vertices: a block of 2^3 cells may stand out by a cell
        self.steps = np.array([stride**2, stride, 1])
        self.corners: Whole = CORNERS @ self.steps

    def indices(self, keys: Whole) -> Whole:
        """(x, y, z) of keys (N,): (N, 3)."""
        return np.asarray(keys[:, None] // self.steps % self.steps[1])

    def positions(self, keys: Whole) -> NDArray[np.float64]:
        """Of vertices (N,), model space: (N, 3)."""
        return np.asarray(self.side * self.indices(keys) - EXTENT, np.float64)

    def closed(self, positions: NDArray[np.float64], values: Array) -> Array:
        """Values (N,) at vertices' positions (N, 3), away from zero; the surface closes where it leaves the ball."""
        outside = np.linalg.norm(positions, axis=1).astype(np.float32) - np.float32(EXTENT)
        values, least = np.maximum(values, outside), np.float32(SNAP * self.side)
        return np.where(np.abs(values) < least, np.where(outside < -least, np.copysign(least, values), least), values)


@dataclass(frozen=True, eq=False)
class Cells:
    """Grid cells with corners of both signs, and those corners.

    cells: (C,) keys, sorted. corners: (C, 8) places in `keys`, in libigl's order. keys: (K,) of vertices, sorted;
    values: (K,) of the field.
    """

    cells: Whole
    corners: Whole
    keys: Whole
    values: Array


def crossed(cells: Whole, corners: Whole, values: Array) -> tuple[Whole, Whole]:
    """Those of cells (N,) and of their corners (N, 8), places in `values`, whose values have both signs."""
    count = np.count_nonzero(values[corners] < 0, axis=1)
    mixed = (count > 0) & (count < 8)
    return cells[mixed], corners[mixed]


def compact(cells: Whole, corners: Whole, keys: Whole, values: Array) -> Cells:
    """The cells in order, with no more vertices than they have."""
    used = np.zeros(len(keys), bool)
    used[corners] = True
    order = np.argsort(cells)
    return Cells(cells[order], (np.cumsum(used) - 1)[corners[order]], keys[used], values[used])


def joined(parts: list[Cells]) -> Cells:
    """The cells of all parts, which share no cell but may share vertices."""
    keys, first = np.unique(np.concatenate([part.keys for part in parts]), return_index=True)
    values = np.concatenate([part.values for part in parts])[first]
    corners = np.concatenate([np.searchsorted(keys, part.keys)[part.corners] for part in parts])
    return compact(np.concatenate([part.cells for part in parts]), corners, keys, values)


def lattice(x: int, y: int, z: int) -> Whole:
    """(i, j, k) with 0 <= i < x and so on, k fastest: (x y z, 3)."""
    return np.argwhere(np.ones((x, y, z), np.bool_))


def sorted_unique(keys: Whole) -> Whole:
    """Keys in order, each once: (M,). NumPy sorts integers faster than `np.unique` finds them."""
    keys = np.sort(keys.ravel())
    first = np.ones(len(keys), np.bool_)
    first[1:] = keys[1:] != keys[:-1]
    return np.asarray(keys[first])
