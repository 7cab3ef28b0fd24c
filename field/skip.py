"""How rays skip a grid of cells in numpy, step by step as glsl/skip.glsl does it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cell_codes import EMPTY, interpolated
from .cells import Cells

CLOSE = 0.2
"""Pixels to the surface, by the grid, from which on the field itself is asked."""

LOOKS = 512
"""How often a ray may look at the grid."""


@dataclass(eq=False)
class Skipping:
    """N rays that skip what a grid of cells, of a field that does not move, says is free of the surface."""

    cells: Cells
    """The grid."""
    origin: NDArray[np.float64]
    """(3,) of all rays, model space."""
    directions: NDArray[np.float64]
    """(N, 3) of length 1."""
    footprint: float
    """Width of a pixel at distance 1."""
    step_scale: float
    """Factor on every step."""
    looks: NDArray[np.int64]
    """(N,) how often a ray has looked at the grid, LOOKS at most."""

    def skip(
        self, indices: NDArray[np.intp], t: NDArray[np.float64], far: NDArray[np.float64], before: NDArray[np.float64]
    ) -> None:
        """Move rays (N,), of those at `indices`, up to where the surface may be, or beyond `far`.

        t: distances along the rays; before: (N, 2) where the last free sphere is along a ray, and its radius; 0: there
        is none. Both are changed in place.
        """
        codes, count = self.cells.grid(), self.cells.count
        scale = 0.5 * count / self.cells.half
        along = scale * self.directions
        along = np.where(along == 0, 1e-6, along)
        active = indices[t[indices] <= far[indices]]
        while len(active):
            active = active[self.looks[active] < LOOKS]
            self.looks[active] += 1
            place = scale * (self.origin + self.cells.half) + t[active, None] * along[active]
            cell = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
            code = codes[cell[:, 2], cell[:, 1], cell[:, 0]]
            empty = code < EMPTY
            step = np.zeros(len(active))
            edge = (1 << code[empty].astype(np.int64))[:, None]
            corner = cell[empty] // edge * edge
            leaving = (corner + np.where(along[active[empty]] > 0, edge, 0) - place[empty]) / along[active[empty]]
            step[empty] = np.maximum(leaving.min(axis=1), 0) + 1e-3 / scale
            step[~empty] = self.step_scale * interpolated(codes, place[~empty]) / scale
            goes = empty | (step > CLOSE * self.footprint * t[active])
            active, step, empty = active[goes], step[goes], empty[goes]
            before[active] = np.stack([t[active], np.where(empty, 0, step)], axis=1)
            t[active] += step
            active = active[t[active] <= far[active]]
