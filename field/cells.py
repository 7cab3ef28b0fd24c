"""A grid of which cells may hold a part of the shape, and how near it is there: rays skip it (glsl/skip.glsl)."""

import numpy as np
from numpy.typing import NDArray

from ..ir.at_time import at_time
from ..ir.program import Program
from .cell_codes import OVERESTIMATE, all_cells, between, middles
from .cell_search import FIRST, found_grid
from .few_levels import few_grid
from .interpret import field

COUNT = 128
"""Cells along an edge of the grid, a power of 2."""
MOVING_COUNT, MOMENTS = 64, 65
"""Of a field that moves: cells along an edge, and the grids that are found, evenly spaced in time from 0 to 1."""


class Cells:
    """Which cells of a cube around the origin the last level's surface cannot meet, and how near it is to the others.

    Of a field that moves, grids are found at some moments, each when it is first needed, and mixed in between.
    """

    count: int
    """Cells along an edge of a grid, N."""
    half: float
    """Half the edge of the cube, model units: it holds the ball that rays are traced in."""
    moments: int
    """Number of grids, evenly spaced in time from 0 to 1; 1 where the field does not move."""

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

    def holds(self, time: float) -> bool:
        """Whether there is a grid for a time: always, but before 0 and after 1 where the field moves."""
        return self.moments == 1 or 0.0 <= time <= 1.0

    def grid(self, time: float = 0.0) -> NDArray[np.uint8]:
        """Return the grid for a time that it `holds`: (N, N, N) bytes, index [z, y, x].

        An empty cell has log2 of the edge, in cells, of the largest empty cube that holds it, of those at multiples of
        their edge. The others, which may hold a part of the surface or are inside of it, have EMPTY or more: a value,
        see `value_of`. Interpolated between the middles of eight cells, of which empty ones count as REACH, values are
        no more than the field outside of the shape, so far as the middles and corners of cells tell. Where the field
        moves, all this is so between two moments, so far as level 1 tells how evenly it changes.
        """
        place = time * (self.moments - 1)
        before = int(place)
        if place == before:
            return self._found(before)
        return between(self._found(before), self._found(before + 1), place - before)

    def _found(self, moment: int) -> NDArray[np.uint8]:
        """Return the grid at a moment."""
        if moment not in self._grids:
            there, slack = at_time(self._program, self._time(moment)), self._slack(moment)
            grid = few_grid if self._few else found_grid
            self._grids[moment] = grid(there, self.count, self.half, slack)
        return self._grids[moment]

    def _time(self, moment: float) -> float:
        """Return the time of a moment, or of what is between two."""
        return moment / (self.moments - 1) if self.moments > 1 else 0.0

    def _slack(self, moment: int) -> float:
        """Return what values at a moment are lowered by, since the field does not change evenly; 0 where it is still.

        It is what the mean of two moments exceeds the field by half-way between them; and where it changes by more than
        the band's half width, a cell that was deep inside at a moment, and counts as empty, may be at the surface.
        """
        if self.moments == 1:
            return 0.0
        points = middles(all_cells(FIRST), FIRST, self.half)
        points = points[np.linalg.norm(points, axis=1) < self.half]
        slack = 0.0
        for first in range(max(0, moment - 1), min(moment + 1, self.moments - 1)):
            before, middle, after = (field(self._program, points, 1, self._time(first + k)) for k in (0, 0.5, 1))
            bend = 0.5 * (before + after) - middle
            change = np.abs(after - before).max() - self._program.bands[0].delta
            slack = max(slack, float(bend.max()), float(change))
        return OVERESTIMATE * slack
