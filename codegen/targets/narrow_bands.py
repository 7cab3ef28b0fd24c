"""Bands that are as narrow as each place allows, as text, for shaders that stand alone (glsl/narrow_bands.glsl)."""

import numpy as np

from ... import glsl
from ...field.narrow import Grid, narrow_widths
from ...ir.program import Program

COUNT = 8
"""Cells along an edge of a grid of widths: a row of them is a number of 32 bits."""
LENGTH = 900
"""Characters that a level's widths take, about."""
SHARE = 0.02
"""Of the text without them, all levels' widths take so much at most."""


def narrow_bands(program: Program, length: int) -> tuple[Grid, ...]:
    """Return the widths of a program's bands that its text has, a grid for each level before the last, or none.

    length: characters of the text without them. Scenes, and fields that move, have none.
    """
    levels = len(program.bands) - 1
    if program.moving or program.composition is not None or LENGTH * levels > SHARE * length:
        return ()
    return narrow_widths(program, COUNT)


def print_bands(grids: tuple[Grid, ...]) -> str:
    """Return the function half_width() of bands with these widths, or of bands that have one width each."""
    if not grids:
        return glsl.load("half_width.glsl")
    numbers = [f"{row}u" for grid in grids for row in rows(grid)]
    lines = [",".join(numbers[first : first + 8]) for first in range(0, len(numbers), 8)]
    declaration = [f"const uint narrow_bands[{len(numbers)}] = uint[](", ",\n".join(lines), ");"]
    return "\n".join(declaration) + "\n" + glsl.load("narrow_bands.glsl")


def rows(grid: Grid) -> list[int]:
    """Return the rows along x of a grid as numbers: four bits for each cell, from the lowest ones up."""
    cells = grid.reshape(-1, len(grid)).astype(np.int64)
    return [int(number) for number in (cells << 4 * np.arange(len(grid))).sum(axis=1)]
