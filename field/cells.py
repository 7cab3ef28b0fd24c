"""A grid of cells that marks empty space and stores the distance elsewhere: rays skip by it (skip.glsl)."""

import numpy as np
from numpy.typing import NDArray

from ..ir.at_time import at_time
from ..ir.program import Program
from .cell_codes import OVERESTIMATE, all_cells, middles, mixed
from .cell_search import FIRST, found_grid
from .coarse_cell_codes import few_grid
from .interpret import field

COUNT = 128
"""Cells along an edge, a power of 2."""
LOOKUPS = 512
"""Largest number of lookups of the grid for one ray (glsl/functions/skip.glsl)."""
NEAR, NEAR_IN_FILE = 1.0, 2.0
"""Radius of a free sphere, in gaps, below which a step is over-relaxed: with this grid, and in shaders of one file."""
MOVING_COUNT, MOMENTS = 64, 65
"""For a moving field: cells along an edge, and number of grids, evenly spaced in time from 0 to 1."""


class Cells:
    """Which cells of a cube around the origin the last level's surface cannot cross, and its distance from the others.

    Grids of a moving field are computed at some times, when they are first needed, and interpolated in between.
    """

    count: int
    """Cells along an edge of a grid, N."""
    half: float
    """Half the edge of the cube, model units; the cube holds the ball in which rays are traced."""
    moments: int
    """Number of grids, evenly spaced in time from 0 to 1; 1 if the field does not move."""

    def __init__(
        self, program: Program, count: int | None = None, moments: int = MOMENTS, *, few: bool = False
    ) -> None:
        """Store the program; grids are computed on demand.

        count: cells along an edge, a power of 2; None for COUNT, or MOVING_COUNT for a moving field. moments: number of
        grids of a moving field, at least 2. few: quantize values to FEW_LEVELS, and set all empty cells to 0.
        """
        self.count = count or (MOVING_COUNT if program.moving else COUNT)
        self.half = 1.0 + program.bands[0].delta
        self.moments = moments if program.moving else 1
        self._few = few
        self._program = program
        self._grids: dict[int, NDArray[np.uint8]] = {}

    def holds(self, time: float) -> bool:
        """Whether there is a grid for a time: not before 0 or after 1, if the field moves."""
        return self.moments == 1 or 0.0 <= time <= 1.0

    def grid(self, time: float = 0.0) -> NDArray[np.uint8]:
        """Return the grid for a time that it `holds`: (N, N, N) bytes, index [z, y, x].

        The byte of an empty cell is log2 of the edge, in cells, of the largest empty cube around it whose corner is at
        multiples of its edge. The byte of any other cell is at least EMPTY and codes a value, see `value_of`. Values
        interpolated between the middles of eight cells, with REACH for empty cells, do not exceed the field outside the
        shape at middles and corners of cells. Between two times, level 1 bounds the deviation from linear motion.
        """
        place = time * (self.moments - 1)
        first = int(place)
        if place == first:
            return self._computed(first)
        return mixed(self._computed(first), self._computed(first + 1), place - first)

    def _computed(self, moment: int) -> NDArray[np.uint8]:
        if moment not in self._grids:
            program, slack = at_time(self._program, self._time(moment)), self._slack(moment)
            compute = few_grid if self._few else found_grid
            self._grids[moment] = compute(program, self.count, self.half, slack)
        return self._grids[moment]

    def _time(self, moment: float) -> float:
        return moment / (self.moments - 1) if self.moments > 1 else 0.0

    def _slack(self, moment: int) -> float:
        """Return the reduction of the values at a moment, because the field does not change linearly; 0 without motion.

        It is the largest excess of the mean of two moments over the field half-way between them. It is at least the
        change beyond delta: a cell deep inside at one moment, which counts as empty, may then be at the surface.
        """
        if self.moments == 1:
            return 0.0
        points = middles(all_cells(FIRST), FIRST, self.half)
        points = points[np.linalg.norm(points, axis=1) < self.half]
        slack = 0.0
        for first in range(max(0, moment - 1), min(moment + 1, self.moments - 1)):
            start, middle, end = (field(self._program, points, 1, self._time(first + k)) for k in (0, 0.5, 1))
            bend = 0.5 * (start + end) - middle
            change = np.abs(end - start).max() - self._program.bands[0].delta
            slack = max(slack, float(bend.max()), float(change))
        return OVERESTIMATE * slack
