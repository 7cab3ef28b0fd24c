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

    domain_error: float | None
    """Mean |f - d| in the unit ball, model units; None where no distance is known, as in a sparse cloud."""
    domain_excess: float | None
    """Share of the unit ball where |f| exceeds |d|, or None likewise."""
    band_error: float | None
    """Mean |f - d| where the last level is defined, in the own band of a single level; or None likewise."""
    gradient: tuple[float, float, float]
    """10th, 50th and 90th percentile of |grad f| on the surface."""


def field_figures(
    domain: tuple[Doubles, Doubles], band: tuple[Doubles, Doubles], gradients: NDArray[np.float32]
) -> FieldFigures:
    """Make the figures of measurements.

    domain, band: f and d at points of the unit ball, and of the band, where d is known: (N,) each. gradients: grad f at
    points of the surface, (M, 3).
    """
    f, distance = domain
    low, middle, high = np.quantile(np.linalg.norm(gradients, axis=1), (0.1, 0.5, 0.9))
    return FieldFigures(
        domain_error=_mean(np.abs(f - distance)),
        domain_excess=_mean(np.abs(f) > EXCESS_FACTOR * np.abs(distance) + EXCESS_OFFSET),
        band_error=_mean(np.abs(band[0] - band[1])),
        gradient=(float(low), float(middle), float(high)),
    )


def written(figure: float | None, how: str) -> str:
    """Write a figure for people by a format such as ".2e"; "not known" where it is None."""
    return "not known" if figure is None else format(figure, how)


def _mean(values: Doubles | NDArray[np.bool_]) -> float | None:
    return float(values.mean()) if len(values) else None
