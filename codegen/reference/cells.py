"""A grid of which cells may hold a part of the shape: rays skip the empty ones (glsl/skip.glsl)."""

import itertools

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Program
from ..ir.still import still
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


MOVING_COUNT, MOMENTS = 64, 32
"""Of a field that moves: cells along an edge, and the grids that follow one another in time, each for an equal share of
the times from 0 to 1."""


class Cells:
    """Which cells of a cube around the origin the last level's surface cannot meet, and in which larger empty cubes.

    Of a field that moves there are several grids, which follow one another in time. Each is found when it is first
    asked for.
    """

    count: int
    """Cells along an edge of a grid, N."""
    half: float
    """Half the edge of the cube, model units: it holds the ball that rays are traced in."""
    moments: int
    """Number of grids, each for an equal share of the times from 0 to 1; 1 where the field does not move."""

    def __init__(self, program: Program, count: int | None = None, moments: int = MOMENTS) -> None:
        """Take the program of a model.

        count: cells along an edge, a power of 2, FIRST at least; None for COUNT, or MOVING_COUNT where the field moves.
        moments: grids of a field that moves, 2 at least.
        """
        self.count = count or (MOVING_COUNT if program.moving else COUNT)
        self.half = 1.0 + program.bands[0].delta
        self.moments = moments if program.moving else 1
        self._program = program
        self._grids: dict[int, NDArray[np.uint8]] = {}

    def moment(self, time: float) -> int | None:
        """Return the index of the grid for a time; None before 0 and after 1, where a field that moves has none."""
        if self.moments == 1:
            return 0
        return min(int(time * self.moments), self.moments - 1) if 0.0 <= time <= 1.0 else None

    def grid(self, moment: int = 0) -> NDArray[np.uint8]:
        """Return a grid (N, N, N), index [z, y, x]. A cell that may hold a part of the surface has 0.

        An empty one has 1 + log2 of the edge, in cells, of the largest empty cube that holds it, of those at multiples
        of their edge. Where the field moves, a cell is empty that is so in the middle of the grid's times, by more than
        level 1 is found to change anywhere in half of them.
        """
        if moment not in self._grids:
            there = still(self._program, self._middle(moment))
            self._grids[moment] = _sizes(there, self.count, self.half, self._slack(moment))
        return self._grids[moment]

    def _middle(self, moment: int) -> float:
        """Return the middle of a grid's times."""
        return (moment + 0.5) / self.moments

    def _slack(self, moment: int) -> float:
        """Return by how much the field may differ from that in the middle of a grid's times; 0 where nothing moves."""
        if self.moments == 1:
            return 0.0
        points = middles(all_cells(FIRST), FIRST, self.half)
        points = points[np.linalg.norm(points, axis=1) < self.half]
        near = range(max(0, moment - 1), min(moment + 2, self.moments))
        values = [field(self._program, points, 1, self._middle(k)) for k in near]
        changes = [float(np.abs(after - before).max()) for before, after in itertools.pairwise(values)]
        return 0.5 * OVERESTIMATE * max(changes)


def all_cells(edge: int) -> NDArray[np.int64]:
    """Return all cells of a grid with so many along an edge, (edge^3, 3), as x, y, z."""
    return np.indices((edge,) * 3).reshape(3, -1).T


def middles(cells: NDArray[np.int64], edge: int, half: float) -> NDArray[np.float32]:
    """Return the middles (N, 3), model units, of cells (N, 3) of a grid with so many along an edge."""
    return (((2 * cells + 1) / edge - 1) * half).astype(np.float32)


def cut_in_eight(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the cells of a grid twice as fine, (8 N, 3), that cells (N, 3) consist of."""
    return np.asarray((2 * cells[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T).reshape(-1, 3))


def _sizes(program: Program, count: int, half: float, slack: float = 0.0) -> NDArray[np.uint8]:
    """Return what Cells.grid does, of a field that does not move.

    slack: what is added to every cell's reach, in the unit of f.
    """
    deltas = [band.delta for band in program.bands]
    cells, edge = all_cells(FIRST), FIRST
    while True:
        points = middles(cells, edge, half)
        reach = OVERESTIMATE * np.sqrt(3) * half / edge + slack
        parts = np.array_split(points, 1 + len(points) // CHUNK)
        cells = cells[np.concatenate([_near(program, part, deltas, reach, edge == count) for part in parts])]
        if edge == count:
            return _sizes_around(cells, count)
        cells, edge = cut_in_eight(cells), 2 * edge


def _near(
    program: Program, points: NDArray[np.float32], deltas: list[float], reach: float, all_levels: bool
) -> NDArray[np.bool_]:
    """Tell which points (N, 3) may be within `reach` of the surface, by level 1 or by all levels."""
    if not all_levels:
        return np.asarray(np.abs(field(program, points, 1)) < deltas[0] + reach, np.bool_)
    value, reached = nested_field(program, points, len(deltas), margins=[reach] * (len(deltas) - 1))
    return np.asarray((reached == len(deltas)) & (np.abs(value) < reach), np.bool_)


def _sizes_around(occupied: NDArray[np.int64], count: int) -> NDArray[np.uint8]:
    """Return the sizes of a grid in which the cells (M, 3), as x, y, z, are occupied."""
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
    """Move rays (N, 3), from t (N,) up to far (N,), to the next cell that is not empty, as glsl/skip.glsl does.

    cells: of a field that does not move.
    """
    count = cells.count
    scale = 0.5 * count / cells.half
    start, along = scale * (origin + cells.half), scale * directions
    along = np.where(along == 0, 1e-6, along)
    t = t.copy()
    active = np.flatnonzero(t <= far)
    while len(active):
        place = start + t[active, None] * along[active]
        cell = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
        size = cells.grid()[cell[:, 2], cell[:, 1], cell[:, 0]].astype(np.int64)
        empty = size > 0
        active, place, cell = active[empty], place[empty], cell[empty]
        edge = (1 << (size[empty] - 1))[:, None]
        corner = cell // edge * edge
        leaving = (corner + np.where(along[active] > 0, edge, 0) - place) / along[active]
        t[active] += np.maximum(leaving.min(axis=1), 0) + 1e-3 / scale
        active = active[t[active] <= far[active]]
    return t
