"""Prints bands whose half-width varies from place to place (narrow_bands.glsl), for shaders in one file."""

import numpy as np

from ... import glsl
from ...field.half_widths import Grid, narrow_widths
from ...ir.program import Program

COUNT = 8
"""Cells along an edge of a grid of widths: a 32-bit number holds a row of them."""
LENGTH = 900
"""Approximate characters of one level's widths."""
SHARE = 0.02
"""Largest share of all widths in the text without them."""


def narrow_bands(program: Program, length: int) -> tuple[Grid, ...]:
    """Return the widths for a program's text: a grid for each level before the last, or none where they are too long.

    length: characters of the text without them. Scenes and moving fields have none.
    """
    levels = len(program.bands) - 1
    if program.moving or program.composition is not None or LENGTH * levels > SHARE * length:
        return ()
    return narrow_widths(program, COUNT)


def print_bands(grids: tuple[Grid, ...]) -> str:
    """Return the function half_width(): with these widths, or with one width per band."""
    if not grids:
        return glsl.load("half_width.glsl")
    numbers = [f"{row}u" for grid in grids for row in rows(grid)]
    lines = [",".join(numbers[first : first + 8]) for first in range(0, len(numbers), 8)]
    declaration = [f"const uint narrow_bands[{len(numbers)}] = uint[](", ",\n".join(lines), ");"]
    return "\n".join(declaration) + "\n" + glsl.load("narrow_bands.glsl")


def rows(grid: Grid) -> list[int]:
    """Return the rows of a grid along x as numbers: four bits for each cell, from the lowest bits up."""
    cells = grid.reshape(-1, len(grid)).astype(np.int64)
    return [int(number) for number in (cells << 4 * np.arange(len(grid))).sum(axis=1)]
