"""A grid of which cells may hold a part of the shape, and how near it is there: rays skip it (glsl/skip.glsl)."""

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
REACH = OVERESTIMATE * np.sqrt(3) / 2
"""Largest absolute value that a cell holds, in edges of a cell: that of a cell which the surface may just touch."""
EMPTY = 8
"""Bytes below this stand for empty cells; the others are levels of a value, from -REACH to REACH."""
FEW_LEVELS = 15
"""Levels of the values of a grid with `few` of them: with that of empty cells, 4 bits hold a cell."""
FINE = 64
"""Cells along an edge of the grid whose middles a grid with few cells is checked at: cells as large as its own would
miss what is thin."""
TRUSTED = 0.5
"""Share of a band's half width beyond which, outside of the band, no residual is asked there: it was trained within."""
ROUNDS = 12
"""How often such a grid is checked, and lowered where it gave too much."""
MISSED = 1.3
"""What interpolation gives too much between the middles of cells is found at the cells' corners, and so many times that
is taken off: it may be more elsewhere."""


MOVING_COUNT, MOMENTS = 64, 32
"""Of a field that moves: cells along an edge, and the grids that follow one another in time, each for an equal share of
the times from 0 to 1."""


class Cells:
    """Which cells of a cube around the origin the last level's surface cannot meet, and how near it is to the others.

    Of a field that moves there are several grids, which follow one another in time. Each is found when it is first
    asked for.
    """

    count: int
    """Cells along an edge of a grid, N."""
    half: float
    """Half the edge of the cube, model units: it holds the ball that rays are traced in."""
    moments: int
    """Number of grids, each for an equal share of the times from 0 to 1; 1 where the field does not move."""

    def __init__(
        self, program: Program, count: int | None = None, moments: int = MOMENTS, *, few: bool = False
    ) -> None:
        """Take the program of a model.

        count: cells along an edge, a power of 2; None for COUNT, or MOVING_COUNT where the field moves. moments: grids
        of a field that moves, 2 at least. few: whether values have FEW_LEVELS, and empty cells all have 0.
        """
        self.count = count or (MOVING_COUNT if program.moving else COUNT)
        self.half = 1.0 + program.bands[0].delta
        self.moments = moments if program.moving else 1
        self._few = few
        self._program = program
        self._grids: dict[int, NDArray[np.uint8]] = {}

    def moment(self, time: float) -> int | None:
        """Return the index of the grid for a time; None before 0 and after 1, where a field that moves has none."""
        if self.moments == 1:
            return 0
        return min(int(time * self.moments), self.moments - 1) if 0.0 <= time <= 1.0 else None

    def grid(self, moment: int = 0) -> NDArray[np.uint8]:
        """Return a grid (N, N, N) of bytes, index [z, y, x].

        An empty cell has log2 of the edge, in cells, of the largest empty cube that holds it, of those at multiples of
        their edge. The others, which may hold a part of the surface or are inside of it, have EMPTY or more: a value,
        see `value_of`. Interpolated between the middles of eight cells, of which empty ones count as REACH, values are
        no more than the field outside of the shape, so far as the middles and corners of cells tell. Where the field
        moves, all this is so of the middle of the grid's times, by more than level 1 is found to change anywhere in
        half of them.
        """
        if moment not in self._grids:
            there = still(self._program, self._middle(moment))
            slack = self._slack(moment)
            grid = _few if self._few else _grid
            self._grids[moment] = grid(there, self.count, self.half, slack)
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


def value_of(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the values, in edges of a cell, that bytes of a grid stand for; of empty cells, REACH."""
    levels = (255 - EMPTY) / 2
    values = np.where(codes < EMPTY, REACH, (codes - (EMPTY + levels)) / levels * REACH)
    return np.asarray(values, np.float32)


def interpolated(codes: NDArray[np.uint8], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values at places (M, 3), x, y, z in cells from the corner of a grid, between the middles of cells."""
    first = np.floor(places - 0.5).astype(np.int64)
    share = places - 0.5 - first
    total = np.zeros(len(places))
    for step in itertools.product((0, 1), repeat=3):
        x, y, z = np.clip(first + step, 0, len(codes) - 1).T
        total += np.prod(np.where(step, share, 1 - share), axis=1) * value_of(codes[z, y, x])
    return total


def _grid(program: Program, count: int, half: float, slack: float = 0.0) -> NDArray[np.uint8]:
    """Return what Cells.grid does, of a field that does not move.

    slack: what is added to every cell's reach, and taken off its value, in the unit of f.
    """
    edge = min(FIRST, count)
    cells = all_cells(edge)
    while edge < count:
        reach = OVERESTIMATE * np.sqrt(3) * half / edge + slack
        near = np.abs(_values(program, middles(cells, edge, half), 1)) < program.bands[0].delta + reach
        cells, edge = cut_in_eight(cells[near]), 2 * edge
    scale = 0.5 * count / half
    reach = REACH / scale
    values = _nested(program, middles(cells, edge, half), reach + slack)
    kept = values < reach + slack
    values = np.where(values > 0, program.bands[-1].step_bound, 1) * values - slack
    codes = _sizes_around(cells[kept], count)
    z, y, x = cells[kept].T[::-1]
    codes[z, y, x] = _coded(scale * values[kept])
    corners, excess = _excess(program, cells[np.abs(values) < reach], codes, scale, slack)
    lowered = np.zeros(codes.shape, np.float32)
    for step in itertools.product((0, 1), repeat=3):
        i, j, k = (corners - step).T[::-1]
        np.maximum.at(lowered, (i, j, k), excess)
    codes[z, y, x] = _coded(value_of(codes[z, y, x]) - MISSED * lowered[z, y, x])
    return codes


def _few(program: Program, count: int, half: float, slack: float = 0.0) -> NDArray[np.uint8]:
    """Return what Cells.grid does with few levels: what `_grid` finds, lowered where finer cells know better."""
    codes = _grid(program, count, half, slack)
    fine = all_cells(FINE)
    points = middles(fine, FINE, half)
    truth = _trusted(program, points) - slack
    scale = 0.5 * count / half
    occupied = fine[truth < OVERESTIMATE * np.sqrt(3) * half / FINE] * count // FINE
    z, y, x = occupied.T[::-1]
    codes[z, y, x] = np.where(codes[z, y, x] < EMPTY, 255, codes[z, y, x])
    codes = _of_few_levels(codes)
    near = scale * truth < REACH
    places, least = (fine[near] + 0.5) * (count / FINE), scale * truth[near]
    first = np.floor(places - 0.5).astype(np.int64)
    for _ in range(ROUNDS):
        between = interpolated(codes, places)
        wrong = (between > 0) & (between > least)
        if not wrong.any():
            break
        lowered = np.zeros(codes.shape, np.float32)
        excess = (between - least)[wrong].astype(np.float32)
        for step in itertools.product((0, 1), repeat=3):
            i, j, k = np.clip(first[wrong] + step, 0, count - 1).T[::-1]
            np.maximum.at(lowered, (i, j, k), excess)
        less = _of_few_levels(_coded(value_of(codes) - MISSED * lowered))
        codes = np.where(lowered > 0, less, codes)
    return codes


def _trusted(program: Program, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Evaluate all levels at points (N, 3), far from the surface, too.

    A residual is asked no farther than TRUSTED half widths beyond its band; elsewhere a positive value is that of the
    coarser level less its half width.
    """
    deltas = np.array([band.delta for band in program.bands[:-1]], np.float32)
    found = []
    for part in np.array_split(points, 1 + len(points) // CHUNK):
        value, reached = nested_field(program, part, len(program.bands), margins=[*(TRUSTED * deltas)])
        beyond = (reached < len(program.bands)) & (value > 0)
        value[beyond] -= deltas[reached[beyond] - 1]
        found.append(value)
    return np.concatenate(found)


def _coded(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return the bytes of values, in edges of a cell, of cells that are not empty; no byte stands for more."""
    levels = (255 - EMPTY) / 2
    return np.asarray(np.clip(np.floor(EMPTY + levels + values / REACH * levels + 1e-4), EMPTY, 255), np.uint8)


def _of_few_levels(codes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return bytes of which those of empty cells are 0, and the others the next lower one of FEW_LEVELS."""
    most = FEW_LEVELS - 1
    lower = (codes.astype(np.int64) - EMPTY) * most // (255 - EMPTY)
    return np.where(codes < EMPTY, 0, EMPTY + lower * (255 - EMPTY) // most).astype(np.uint8)


def _excess(
    program: Program, cells: NDArray[np.int64], codes: NDArray[np.uint8], scale: float, slack: float
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Find where interpolation exceeds the field at corners of cells (M, 3), outside of the shape.

    Returns these corners (K, 3), inside the grid, and by how much it does, in edges of a cell (K,).
    """
    count = len(codes)
    corners = (cells[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T).reshape(-1, 3)
    corners = corners[((corners > 0) & (corners < count)).all(axis=1)]
    keys = np.unique(corners @ np.array([1, count, count**2]))
    corners = np.stack([keys % count, keys // count % count, keys // count**2], axis=1)
    between = interpolated(codes, corners.astype(np.float64))
    corners, between = corners[between > 0], between[between > 0]
    points = ((2 * corners / count - 1) * (0.5 * count / scale)).astype(np.float32)
    values = _nested(program, points, REACH / scale + slack) - slack
    return corners, np.maximum(between - np.minimum(scale * values, REACH), 0).astype(np.float32)


def _nested(program: Program, points: NDArray[np.float32], margin: float) -> NDArray[np.float32]:
    """Evaluate all levels at points (N, 3), each in the band of the one before, wider by `margin`."""
    return _values(program, points, len(program.bands), margin)


def _values(program: Program, points: NDArray[np.float32], level: int, margin: float = 0.0) -> NDArray[np.float32]:
    """Evaluate levels at points (N, 3); where the last one is not defined, the value is out of the widened band."""
    parts = np.array_split(points, 1 + len(points) // CHUNK)
    margins = [margin] * (level - 1)
    return np.concatenate([nested_field(program, part, level, margins=margins)[0] for part in parts])


def _sizes_around(occupied: NDArray[np.int64], count: int) -> NDArray[np.uint8]:
    """Return the sizes of a grid in which the cells (M, 3), as x, y, z, are occupied."""
    full: NDArray[np.bool_] = np.zeros((count, count, count), np.bool_)
    full[occupied[:, 2], occupied[:, 1], occupied[:, 0]] = True
    sizes: NDArray[np.uint8] = np.zeros(full.shape, np.uint8)
    for power in range(1, count.bit_length()):
        side = full.shape[0] // 2
        full = np.asarray(full.reshape(side, 2, side, 2, side, 2).any(axis=(1, 3, 5)))
        empty: NDArray[np.bool_] = ~full
        for axis in range(3):
            empty = empty.repeat(1 << power, axis=axis)
        sizes[empty] = power
    return sizes
