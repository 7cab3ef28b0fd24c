"""The cells that a surface passes, found by leaving out blocks that cannot hold it, or by looking at every vertex."""

import numpy as np

from .grid import CORNERS, EXTENT, Cells, Grid, compact, crossed, joined, lattice, sorted_unique
from .memory import check_memory
from .model_field import Field
from .parallel import Progress, over
from .surface import Array, Whole

FIRST = 4
"""Culling begins with 2^FIRST blocks along each side of the grid."""
CHUNK = 2048
"""How many blocks of 2^3 cells are searched for the surface at a time."""
BYTES_OF_BLOCK = 1700
"""Memory that a block of 2^3 cells near the surface takes at most until its mesh is written; measured."""
BYTES_OF_COLUMN = 200
"""Memory that a cell of a layer takes where the whole grid is evaluated."""
BLOCK_CELLS = lattice(2, 2, 2)
"""Places (x, y, z) of the 8 cells in a block of 2^3 cells: (8, 3)."""
BLOCK_VERTICES = lattice(3, 3, 3)
"""Places (x, y, z) of the 27 vertices in a block of 2^3 cells: (27, 3)."""
BLOCK_CORNERS = (BLOCK_CELLS[:, None] + CORNERS) @ np.array([9, 3, 1])
"""The corners of the 8 cells, as rows of BLOCK_VERTICES: (8, 8)."""


def culled(field: Field, grid: Grid, progress: Progress) -> Cells:
    """Find the cells that the surface passes, from coarse blocks to fine ones (after Fig. 5).

    A block is left out where the field's clearance at its centre exceeds half its diagonal; the others are halved along
    each side. The field is evaluated at the vertices of the blocks of 2^3 cells that are left in the end.
    Raises UserError where these do not fit the memory.
    """
    size = 2 ** max((grid.resolution - 1).bit_length() - FIRST, 1)
    side = -(-grid.resolution // size)

    def near(blocks: Whole) -> Whole:
        centres = (blocks + size / 2) * grid.side - EXTENT
        traced = np.linalg.norm(centres, axis=1) <= EXTENT + size * grid.diagonal / 2
        blocks = blocks[traced]
        kept: Whole = blocks[field.clearance(centres[traced].astype(np.float32)) <= size * grid.diagonal / 2]
        return kept

    def halved(blocks: Whole) -> tuple[Whole]:
        parts = (blocks[:, None] + size * BLOCK_CELLS).reshape(-1, 3)
        return (near(parts[(parts < grid.resolution).all(axis=1)]),)

    blocks = near(lattice(side, side, side) * size)
    while size > 2:
        size //= 2
        progress.begin(f"culling blocks of {size}", len(blocks))
        # Chunk by chunk, since eight times as many blocks would not fit the memory where those that are left do.
        (blocks,) = over(blocks, halved, progress, max(1, field.chunk // len(BLOCK_CELLS)))
    check_memory(BYTES_OF_BLOCK * len(blocks), grid.resolution)
    cells = _evaluated_blocks(field, np.sort(blocks @ grid.steps), grid, progress)
    return _closed(field, cells, grid, progress)


def dense(field: Field, grid: Grid, progress: Progress) -> Cells:
    """Find the cells that the surface passes by evaluating the field at every vertex, one layer in x after another.

    Raises UserError where a layer does not fit the memory.
    """
    check_memory(BYTES_OF_COLUMN * grid.resolution**2, grid.resolution)
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
    """Evaluate the field at vertices with keys (N,): values (N,) that give a closed surface (`Grid.closed`)."""

    def work(part: Whole) -> tuple[Array]:
        positions = grid.positions(part)
        return (grid.closed(positions, field.value(positions.astype(np.float32))),)

    (values,) = over(keys, work, progress, field.chunk)
    return values


def _evaluated_blocks(field: Field, blocks: Whole, grid: Grid, progress: Progress) -> Cells:
    """Find the cells that the surface passes in blocks of 2^3 cells.

    blocks: (N,) keys of their lowest corners, sorted.
    """
    keys = sorted_unique(blocks[:, None] + BLOCK_VERTICES @ grid.steps)
    progress.begin("evaluating", len(keys))
    values = evaluated(field, keys, grid, progress)

    def work(part: Whole) -> tuple[Whole, Whole]:
        # Vertices that follow one another along z do so in `keys`, so one of three is searched for.
        first = np.searchsorted(keys, part[:, None] + BLOCK_VERTICES[::3] @ grid.steps)
        corners = (first[:, :, None] + np.arange(3)).reshape(-1, 27)[:, BLOCK_CORNERS].reshape(-1, 8)
        return crossed((part[:, None] + BLOCK_CELLS @ grid.steps).ravel(), corners, values)

    progress.begin("looking for the surface", len(blocks))
    cells, corners = over(blocks, work, progress, CHUNK)
    inside = (grid.indices(cells) < grid.resolution).all(axis=1)
    return compact(cells[inside], corners[inside], keys, values)


def _closed(field: Field, cells: Cells, grid: Grid, progress: Progress) -> Cells:
    """Add the cells that the surface goes on into, so that it has no rim even where culling left out too much."""
    while len(missing := _beyond(cells, grid)):
        progress.begin("following the surface", len(missing))
        keys = sorted_unique(missing[:, None] + grid.corners)
        values = evaluated(field, keys, grid, progress)
        corners = np.searchsorted(keys, missing[:, None] + grid.corners)
        cells = joined([cells, compact(*crossed(missing, corners, values), keys, values)])
    return cells


def _beyond(cells: Cells, grid: Grid) -> Whole:
    """Find the cells behind faces with corners of both signs that are not among `cells`: (N,) keys, sorted."""
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
