"""Errors of a field as a signed distance, for the trainer and for `eval`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

EXCESS_FACTOR, EXCESS_OFFSET = 1.05, 1e-3
"""A value overestimates a distance d if |f| > factor * d + offset, model units: rays may step through the surface."""


@dataclass(frozen=True)
class FieldFigures:
    """Errors of the nested field f (Eq. 3) against the signed distance d, and lengths of its gradient."""

    domain_error: float | None
    """Mean |f - d| in the unit ball, model units; None if the distance is unknown, for example for a sparse cloud."""
    domain_excess: float | None
    """Fraction of the unit ball where |f| overestimates |d|; or None."""
    band_error: float | None
    """Mean |f - d| where the last level is defined (for a single level: in its own band); or None."""
    gradient: tuple[float, float, float]
    """10th, 50th and 90th percentile of |grad f| on the surface."""


def field_figures(
    domain: tuple[Doubles, Doubles], band: tuple[Doubles, Doubles], gradients: NDArray[np.float32]
) -> FieldFigures:
    """Compute the errors from samples.

    domain, band: f and d, (N,) each, at points of the unit ball and of the band where d is known. gradients: (M, 3),
    grad f at points of the surface.
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
    """Format a figure, for example as ".2e"; None becomes "not known"."""
    return "not known" if figure is None else format(figure, how)


def _mean(values: Doubles | NDArray[np.bool_]) -> float | None:
    return float(values.mean()) if len(values) else None
