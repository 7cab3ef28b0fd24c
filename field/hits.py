"""Where rays met a surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Hits:
    """What became of rays; every array begins with the shape (...) that the rays have."""

    hit: NDArray[np.bool_]
    """(...), whether a ray met the surface."""
    t: NDArray[np.float64]
    """(...), the distance from its origin; infinity where it missed."""
    points: NDArray[np.float64]
    """(..., 3), where; not a number where it missed."""
    normals: NDArray[np.float32]
    """(..., 3), the gradient there, of length 1; not a number where it missed."""

    def __repr__(self) -> str:
        """Say how many rays there were, and how many met the surface."""
        return f"<mplicits.Hits: {np.count_nonzero(self.hit):,} of {self.hit.size:,} rays>"
