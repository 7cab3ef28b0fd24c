"""The cells that a surface crosses, found by culling blocks of cells, or by evaluating every vertex."""

import numpy as np

from ..model.memory import check_memory
from .grid import CORNERS, EXTENT, Cells, Grid, compact, crossed, joined, lattice, sorted_unique
from .model_field import Field
from .parallel import Progress, over
from .surface import Array, Whole

FIRST = 4
"""Culling starts with 2^FIRST blocks along each side of the grid."""
CHUNK = 2048
"""Blocks of 2^3 cells that are searched for the surface at a time."""
BYTES_OF_BLOCK = 1700
"""Peak memory for a block of 2^3 cells near the surface, up to the written mesh; measured."""
BYTES_OF_COLUMN = 200
"""Memory for a cell of a layer when the whole grid is evaluated."""
BLOCK_CELLS = lattice(2, 2, 2)
"""(8, 3) indices (x, y, z) of the cells in a block of 2^3 cells."""
BLOCK_VERTICES = lattice(3, 3, 3)
"""(27, 3) indices (x, y, z) of the vertices of a block of 2^3 cells."""
BLOCK_CORNERS = (BLOCK_CELLS[:, None] + CORNERS) @ np.array([9, 3, 1])
"""(8, 8) corners of the 8 cells, as rows of BLOCK_VERTICES."""


def culled(field: Field, grid: Grid, progress: Progress) -> Cells:
    """Find the cells that the surface crosses, from coarse blocks to fine blocks (after Fig. 5).

    Cull a block if the field's clearance at its center exceeds half its diagonal; halve the others along each side.
    Evaluate the field at the vertices of the remaining blocks of 2^3 cells. Raises UserError without enough memory.
    """
    size = 2 ** max((grid.resolution - 1).bit_length() - FIRST, 1)
    side = -(-grid.resolution // size)

    def near(blocks: Whole) -> Whole:
        centers = (blocks + size / 2) * grid.side - EXTENT
        traced = np.linalg.norm(centers, axis=1) <= EXTENT + size * grid.diagonal / 2
        blocks = blocks[traced]
        kept: Whole = blocks[field.clearance(centers[traced].astype(np.float32)) <= size * grid.diagonal / 2]
        return kept

    def halved(blocks: Whole) -> tuple[Whole]:
        parts = (blocks[:, None] + size * BLOCK_CELLS).reshape(-1, 3)
        return (near(parts[(parts < grid.resolution).all(axis=1)]),)

    blocks = near(lattice(side, side, side) * size)
    while size > 2:
        size //= 2
        progress.begin(f"culling blocks of {size}", len(blocks))
        # In chunks: eight times as many blocks may not fit the memory, though the remaining blocks do.
        (blocks,) = over(blocks, halved, progress, max(1, field.chunk // len(BLOCK_CELLS)))
    _check_memory(BYTES_OF_BLOCK * len(blocks), grid)
    cells = _evaluated_blocks(field, np.sort(blocks @ grid.steps), grid, progress)
    return _closed(field, cells, grid, progress)


def _check_memory(needed: float, grid: Grid) -> None:
    """Raise UserError, which names --resolution, if fewer than `needed` bytes are free."""
    check_memory(needed, f"--resolution {grid.resolution}: this surface", "choose a lower resolution")


def dense(field: Field, grid: Grid, progress: Progress) -> Cells:
    """Find the cells that the surface crosses by evaluating the field at every vertex, layer by layer in x.

    Raises UserError if a layer does not fit the memory.
    """
    _check_memory(BYTES_OF_COLUMN * grid.resolution**2, grid)
    layer = int(grid.steps[0])
    progress.begin("evaluating", (grid.resolution + 1) * layer)
    cells = lattice(1, grid.resolution, grid.resolution) @ grid.steps
    corners = cells[:, None] + grid.corners
    before = evaluated(field, np.arange(layer), grid, progress)
    layers = []
    for x in range(grid.resolution):
        keys = np.arange(x * layer, (x + 2) * layer)
        values = np.concatenate((before, evaluated(field, keys[layer:], grid, progress)))
        crossed_cells, crossed_corners = crossed(cells, corners, values)
        layers.append(compact(crossed_cells + x * layer, crossed_corners, keys, values))
        before = values[layer:]
    return joined(layers)


def evaluated(field: Field, keys: Whole, grid: Grid, progress: Progress) -> Array:
    """Evaluate the field at vertices with keys (N,), and make the surface closed (`Grid.closed`): (N,)."""

    def work(part: Whole) -> tuple[Array]:
        positions = grid.positions(part)
        return (grid.closed(positions, field.value(positions.astype(np.float32))),)

    (values,) = over(keys, work, progress, field.chunk)
    return values


def _evaluated_blocks(field: Field, blocks: Whole, grid: Grid, progress: Progress) -> Cells:
    """Find the cells that the surface crosses in blocks of 2^3 cells. blocks: (N,) sorted keys of lowest corners."""
    keys = sorted_unique(blocks[:, None] + BLOCK_VERTICES @ grid.steps)
    progress.begin("evaluating", len(keys))
    values = evaluated(field, keys, grid, progress)

    def work(part: Whole) -> tuple[Whole, Whole]:
        # Three vertices along z are consecutive in `keys`: search for the first of them.
        first = np.searchsorted(keys, part[:, None] + BLOCK_VERTICES[::3] @ grid.steps)
        corners = (first[:, :, None] + np.arange(3)).reshape(-1, 27)[:, BLOCK_CORNERS].reshape(-1, 8)
        return crossed((part[:, None] + BLOCK_CELLS @ grid.steps).ravel(), corners, values)

    progress.begin("finding the surface", len(blocks))
    cells, corners = over(blocks, work, progress, CHUNK)
    inside = (grid.indices(cells) < grid.resolution).all(axis=1)
    return compact(cells[inside], corners[inside], keys, values)


def _closed(field: Field, cells: Cells, grid: Grid, progress: Progress) -> Cells:
    """Add culled cells that the surface continues into, so that the surface has no rim."""
    while len(missing := _beyond(cells, grid)):
        progress.begin("following the surface", len(missing))
        keys = sorted_unique(missing[:, None] + grid.corners)
        values = evaluated(field, keys, grid, progress)
        corners = np.searchsorted(keys, missing[:, None] + grid.corners)
        cells = joined([cells, compact(*crossed(missing, corners, values), keys, values)])
    return cells


def _beyond(cells: Cells, grid: Grid) -> Whole:
    """Find the missing cells behind faces with corners of both signs: (N,) sorted keys."""
    negative = cells.values[cells.corners] < 0
    candidates = []
    for axis in range(3):
        for side in (0, 1):
            count = np.count_nonzero(negative[:, CORNERS[:, axis] == side], axis=1)
            mixed = cells.cells[(count > 0) & (count < 4)]
            candidates.append(mixed + (grid.steps[axis] if side else -grid.steps[axis]))
    keys = np.concatenate(candidates)
    near = np.minimum(np.searchsorted(cells.cells, keys), len(cells.cells) - 1)
    return sorted_unique(keys[cells.cells[near] != keys])
