"""Prints the grid of cells that rays skip as CUDA (cuda_source/unpack.cuh)."""

import numpy as np
from numpy.typing import NDArray

from ...field.cell_codes import EMPTY
from ...field.cells import COUNT, NEAR, Cells
from ...ir.program import Program
from ..printers.cstyle import Language


def print_cells(program: Program, language: Language) -> list[str]:
    """Return the declarations of a program's grid; an empty grid where the field moves."""
    cells = Cells(program, COUNT)
    count = 0 if program.moving else COUNT
    numbers = packed(cells.grid()) if count else [0]
    rows = [", ".join(f"{number}u" for number in numbers[first : first + 10]) for first in range(0, len(numbers), 10)]
    return [
        f"constexpr int CELL_COUNT = {count};  // along an edge of the grid that rays skip",
        f"constexpr float CELLS_HALF = {language.number(cells.half)};",
        f"constexpr float NEAR = {language.number(NEAR)};  // see skip.glsl",
        f"const unsigned CELLS[{len(numbers)}] = {{",
        *(f"    {row}," for row in rows),
        "};",
    ]


def packed(grid: NDArray[np.uint8]) -> list[int]:
    """Pack a grid (N, N, N), N a power of 2, into 32-bit numbers: four bytes each, the first in the lowest bits.

    Cells are in Morton order, whose index interleaves the bits of z, y and x. In it the cells of an empty cube, whose
    corners are multiples of its edge, are consecutive: one byte, at its first cell, stores the cube.
    """
    bits = len(grid).bit_length() - 1
    axes = [axis * bits + bit for bit in range(bits) for axis in range(3)]
    codes = grid.reshape((2,) * (3 * bits)).transpose(axes).ravel()
    sizes = np.where(codes < EMPTY, 8 ** np.minimum(codes, EMPTY).astype(np.int64), 1)
    kept = codes[np.arange(len(codes)) % sizes == 0]
    return [int(number) for number in np.pad(kept, (0, -len(kept) % 4)).view("<u4")]
