"""How far a field is from the signed distance that it stands for: figures that the trainer and `eval` both print."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

EXCESS_FACTOR, EXCESS_OFFSET = 1.05, 1e-3
"""A value exceeds a distance d where |f| > factor * d + offset, model units: rays may step through the surface."""


@dataclass(frozen=True)
class FieldFigures:
    """How far the nested field f (Eq. 3) is from the signed distance d, and its gradient from length one."""

    domain_error: float
    """Mean |f - d| in the unit ball, model units."""
    domain_excess: float
    """Share of the unit ball where |f| exceeds |d|."""
    band_error: float
    """Mean |f - d| where the last level is defined, in the own band of a single level; model units."""
    gradient: tuple[float, float, float]
    """10th, 50th and 90th percentile of |grad f| on the surface."""


def field_figures(
    domain: tuple[Doubles, Doubles], band: tuple[Doubles, Doubles], gradients: NDArray[np.float32]
) -> FieldFigures:
    """Make the figures of measurements.

    domain, band: f and d at points of the unit ball, and of the band: (N,) each, at least one in the ball. gradients:
    grad f at points of the surface, (M, 3).
    """
    f, distance = domain
    low, middle, high = np.quantile(np.linalg.norm(gradients, axis=1), (0.1, 0.5, 0.9))
    return FieldFigures(
        domain_error=float(np.abs(f - distance).mean()),
        domain_excess=float((np.abs(f) > EXCESS_FACTOR * np.abs(distance) + EXCESS_OFFSET).mean()),
        band_error=float(np.abs(band[0] - band[1]).mean()) if len(band[0]) else 0.0,
        gradient=(float(low), float(middle), float(high)),
    )
