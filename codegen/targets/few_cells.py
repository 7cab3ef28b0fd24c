"""Prints a small grid of cells, for shaders without a cell texture (glsl/functions/skip.glsl)."""

import numpy as np

from ...field.cell_codes import EMPTY
from ...field.cells import Cells
from ...field.coarse_cell_codes import FEW_LEVELS
from ...ir.program import Program
from ..printers.cstyle import Language

COUNTS = (16, 8)
"""Cells along an edge of the possible grids, the best first."""


def few_cells(program: Program, language: Language, room: float) -> tuple[str, Cells | None]:
    """Return text that defines FEW_CELLS, and its grid; "" and None where the field moves or no grid fits.

    room: most characters of the text.
    """
    if program.moving:
        return "", None
    grids = (Cells(program, count, few=True) for count in COUNTS)
    texts = ((_text(cells, program, language), cells) for cells in grids)
    return next(((text, cells) for text, cells in texts if len(text) <= room), ("", None))


def packed(cells: Cells) -> list[int]:
    """Pack a grid with few levels into 32-bit numbers: eight cells each, the first in the lowest four bits.

    0 is an empty cell; 1 to FEW_LEVELS are the levels of a value.
    """
    codes = cells.grid().reshape(-1, 8).astype(np.int64)
    span = 255 - EMPTY
    levels = np.where(codes < EMPTY, 0, 1 - (EMPTY - codes) * (FEW_LEVELS - 1) // span)
    return [int(number) for number in (levels << 4 * np.arange(8)).sum(axis=1)]


def _text(cells: Cells, program: Program, language: Language) -> str:
    numbers = [f"{number}u" for number in packed(cells)]
    rows = [",".join(numbers[first : first + 8]) for first in range(0, len(numbers), 8)]
    lines = [
        "#define FEW_CELLS // how near the surface is, in a grid; see skip()",
        f"const int cell_count = {cells.count};",
        f"const float cells_half = {language.number(cells.half)};",
        f"const float CELLS_DELTA = {language.number(program.bands[0].delta)};",
        f"const uint few_cells[{len(numbers)}] = uint[](",
        ",\n".join(rows),
        ");",
    ]
    return "\n".join(lines) + "\n"
