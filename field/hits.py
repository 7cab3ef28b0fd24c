"""Intersections of rays with a surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Hits:
    """Intersections of rays of shape (...) with the surface."""

    hit: NDArray[np.bool_]
    """(...), whether the ray meets the surface."""
    t: NDArray[np.float64]
    """(...), distance from the ray's origin; infinity for a miss."""
    points: NDArray[np.float64]
    """(..., 3), the intersections; NaN for a miss."""
    normals: NDArray[np.float32]
    """(..., 3), the gradients there, of length 1; NaN for a miss."""

    def __repr__(self) -> str:
        return f"<mplicits.Hits: {np.count_nonzero(self.hit):,} of {self.hit.size:,} rays>"
