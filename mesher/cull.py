"""Which cells the surface passes: by blocks that leave out what cannot hold it, or by looking at every vertex."""

import numpy as np

from .field import Field
from .grid import CORNERS, EXTENT, Cells, Grid, compact, crossed, joined, lattice, sorted_unique
from .parallel import Progress, over
from .surface import Array, Whole

FIRST = 4
"""Culling begins with 2^FIRST blocks along each side."""
BLOCKS = 2048
"""Blocks that are looked through at a time."""
HALVES = lattice(2, 2, 2)
BLOCK = lattice(3, 3, 3)
"""(x, y, z) of the 8 cells of a block of 2^3, and of its 27 vertices."""
BLOCK_CORNERS = (HALVES[:, None] + CORNERS) @ np.array([9, 3, 1])
"""Places among the vertices of the corners of the cells: (8, 8)."""


def culled(field: Field, grid: Grid, progress: Progress) -> Cells:
    """The cells that the surface passes, found from coarse blocks to fine ones (after Fig. 5).

    A block is left out where the field's clearance at its centre exceeds its radius. What remains are blocks of 2^3
    cells, evaluated at their vertices.
    """
    size = 2 ** max((grid.resolution - 1).bit_length() - FIRST, 1)
    side = -(-grid.resolution // size)
    blocks = lattice(side, side, side) * size
    while True:
        centres = (blocks + size / 2) * grid.side - EXTENT
        near = np.linalg.norm(centres, axis=1) <= EXTENT + size * grid.diagonal / 2
        blocks, centres = blocks[near], centres[near].astype(np.float32)
        progress.begin(f"culling blocks of {size}", len(blocks))
        (clearance,) = over(centres, lambda part: (field.clearance(part),), progress, field.chunk)
        blocks = blocks[clearance <= size * grid.diagonal / 2]
        if size == 2:
            found = _evaluated_blocks(field, np.sort(blocks @ grid.steps), grid, progress)
            return _closed(field, found, grid, progress)
        size //= 2
        blocks = (blocks[:, None] + size * HALVES).reshape(-1, 3)
        blocks = blocks[(blocks < grid.resolution).all(axis=1)]


def dense(field: Field, grid: Grid, progress: Progress) -> Cells:
    """The cells that the surface passes, by the field's value at every vertex, layer after layer."""
    layer = int(grid.steps[0])
    progress.begin("evaluating", (grid.resolution + 1) * layer)
    cells = lattice(1, grid.resolution, grid.resolution) @ grid.steps
    corners = cells[:, None] + grid.corners
    before = evaluated(field, np.arange(layer), grid, progress)
    found = []
    for x in range(grid.resolution):
        keys = np.arange(x * layer, (x + 2) * layer)
        values = np.concatenate((before, evaluated(field, keys[layer:], grid, progress)))
        passed, its_corners = crossed(cells, corners, values)
        found.append(compact(passed + x * layer, its_corners, keys, values))
        before = values[layer:]
    return joined(found)


def evaluated(field: Field, keys: Whole, grid: Grid, progress: Progress) -> Array:
    """The field's values (N,) at vertices (N,)."""

    def work(part: Whole) -> tuple[Array]:
        positions = grid.positions(part)
        return (grid.closed(positions, field.value(positions.astype(np.float32))),)

    (values,) = over(keys, work, progress, field.chunk)
    return values


def _evaluated_blocks(field: Field, blocks: Whole, grid: Grid, progress: Progress) -> Cells:
    """The cells that the surface passes in blocks (N,) of 2^3 cells, keys of their lowest corners, sorted."""
    keys = sorted_unique(blocks[:, None] + BLOCK @ grid.steps)
    progress.begin("evaluating", len(keys))
    values = evaluated(field, keys, grid, progress)

    def work(part: Whole) -> tuple[Whole, Whole]:
        # Vertices that follow one another along z do so in `keys`.
        first = np.searchsorted(keys, part[:, None] + BLOCK[::3] @ grid.steps)
        corners = (first[:, :, None] + np.arange(3)).reshape(-1, 27)[:, BLOCK_CORNERS].reshape(-1, 8)
        return crossed((part[:, None] + HALVES @ grid.steps).ravel(), corners, values)

    progress.begin("looking for the surface", len(blocks))
    cells, corners = over(blocks, work, progress, BLOCKS)
    inside = (grid.indices(cells) < grid.resolution).all(axis=1)
    return compact(cells[inside], corners[inside], keys, values)


def _closed(field: Field, found: Cells, grid: Grid, progress: Progress) -> Cells:
    """`found` and the cells that its surface goes on into: even where a bound was too small, there is no rim."""
    while len(missing := _beyond(found, grid)):
        progress.begin("following the surface", len(missing))
        keys = sorted_unique(missing[:, None] + grid.corners)
        values = evaluated(field, keys, grid, progress)
        corners = np.searchsorted(keys, missing[:, None] + grid.corners)
        found = joined([found, compact(*crossed(missing, corners, values), keys, values)])
    return found


def _beyond(found: Cells, grid: Grid) -> Whole:
    """Cells next to those found, not among them, across a face with corners of both signs: (N,), sorted."""
    negative = found.values[found.corners] < 0
    candidates = []
    for axis in range(3):
        for side in (0, 1):
            count = np.count_nonzero(negative[:, CORNERS[:, axis] == side], axis=1)
            mixed = found.cells[(count > 0) & (count < 4)]
            candidates.append(mixed + (grid.steps[axis] if side else -grid.steps[axis]))
    keys = np.concatenate(candidates)
    near = np.minimum(np.searchsorted(found.cells, keys), len(found.cells) - 1)
    return sorted_unique(keys[found.cells[near] != keys])
