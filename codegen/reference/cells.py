"""A grid of which cells may hold a part of the shape: rays skip the empty ones (glsl/skip.glsl)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Program
from .interpret import field, nested_field

COUNT = 128
"""Cells along an edge of the grid, a power of 2."""
FIRST = 16
"""Cells along an edge that the search begins with; each that may hold a part is then cut into eight, and so on."""
OVERESTIMATE = 1.3
"""How many times the distance to the shape |f| may be: a cell is empty where |f| in its middle exceeds this times the
way to its corner. Trained fields may exceed the distance by more, 1.66 times at worst in slits that they close
(docs/results/field.md), but not so near to their own surface: benchmarks/frames.py counts what is lost."""
CHUNK = 65_536
"""Cells whose field is evaluated at a time."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Which cells of a cube around the origin the last level's surface cannot meet, and in which larger empty cubes."""

    sizes: NDArray[np.uint8]
    """(N, N, N), index [z, y, x]: 0 for a cell that may hold a part of the surface; for an empty one, 1 + log2 of the
    edge, in cells, of the largest empty cube that holds it, of those at multiples of their edge."""
    half: float
    """Half the edge of the cube, model units: it holds the ball that rays are traced in."""


def empty_cells(program: Program, count: int = COUNT) -> Cells | None:
    """Find the cells that the surface of the last level does not meet; None for a field that moves.

    count: cells along an edge, a power of 2, FIRST at least.
    """
    if program.moving:
        return None
    deltas = [band.delta for band in program.bands]
    half = 1.0 + deltas[0]
    axis = np.arange(FIRST)
    cells = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = FIRST
    while True:
        points = (((2 * cells + 1) / edge - 1) * half).astype(np.float32)
        reach = OVERESTIMATE * np.sqrt(3) * half / edge
        parts = np.array_split(points, 1 + len(points) // CHUNK)
        cells = cells[np.concatenate([_near(program, part, deltas, reach, edge == count) for part in parts])]
        if edge == count:
            return Cells(_sizes(cells, count), half)
        cells = (2 * cells[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T).reshape(-1, 3)
        edge *= 2


def _near(
    program: Program, points: NDArray[np.float32], deltas: list[float], reach: float, all_levels: bool
) -> NDArray[np.bool_]:
    """Tell which points (N, 3) may be within `reach` of the surface, by level 1 or by all levels."""
    if not all_levels:
        return np.asarray(np.abs(field(program, points, 1)) < deltas[0] + reach, np.bool_)
    value, reached = nested_field(program, points, len(deltas), margins=[reach] * (len(deltas) - 1))
    return np.asarray((reached == len(deltas)) & (np.abs(value) < reach), np.bool_)


def _sizes(occupied: NDArray[np.int64], count: int) -> NDArray[np.uint8]:
    """Return Cells.sizes of a grid in which the cells (M, 3), as x, y, z, are occupied."""
    full: NDArray[np.bool_] = np.zeros((count, count, count), np.bool_)
    full[occupied[:, 2], occupied[:, 1], occupied[:, 0]] = True
    sizes = np.where(full, 0, 1).astype(np.uint8)
    for power in range(1, count.bit_length()):
        side = full.shape[0] // 2
        full = np.asarray(full.reshape(side, 2, side, 2, side, 2).any(axis=(1, 3, 5)))
        empty: NDArray[np.bool_] = ~full
        for axis in range(3):
            empty = empty.repeat(1 << power, axis=axis)
        sizes[empty] = power + 1
    return sizes


def skip(
    cells: Cells,
    origin: NDArray[np.float64],
    directions: NDArray[np.float64],
    t: NDArray[np.float64],
    far: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Move rays (N, 3), from t (N,) up to far (N,), to the next cell that is not empty, as glsl/skip.glsl does."""
    count = len(cells.sizes)
    scale = 0.5 * count / cells.half
    start, along = scale * (origin + cells.half), scale * directions
    along = np.where(along == 0, 1e-6, along)
    t = t.copy()
    active = np.flatnonzero(t <= far)
    while len(active):
        place = start + t[active, None] * along[active]
        cell = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
        size = cells.sizes[cell[:, 2], cell[:, 1], cell[:, 0]].astype(np.int64)
        empty = size > 0
        active, place, cell = active[empty], place[empty], cell[empty]
        edge = (1 << (size[empty] - 1))[:, None]
        corner = cell // edge * edge
        leaving = (corner + np.where(along[active] > 0, edge, 0) - place) / along[active]
        t[active] += np.maximum(leaving.min(axis=1), 0) + 1e-3 / scale
        active = active[t[active] <= far[active]]
    return t
