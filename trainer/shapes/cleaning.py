"""A cloud without its outliers and its noise, as training sees it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from . import noise
from .duplicates import merge
from .outliers import outliers
from .shape import Doubles, SurfacePoints, normalise, unit

FEWEST_LEFT = 50
"""Fewest points that training sees after noise is removed."""


@dataclass(frozen=True, eq=False)
class CleanCloud:
    """The points of a cloud in model space, some of them kept for evaluation, and what was taken away from them."""

    kept: SurfacePoints
    """Points that training sees."""
    held_out: SurfacePoints
    """Points kept for evaluation, which `kept` knows nothing of."""
    centre: tuple[float, float, float]
    """Of model space: see `Shape.centre`."""
    scale: float
    """Of model space: see `Shape.scale`."""
    noise: float
    """Standard deviation of the noise that was in the points, model units; 0 for exact points."""
    record: dict[str, Any]
    """What the provenance keeps under `noise`; empty where there was neither noise nor an outlier."""


def clean(
    points: Doubles, normals: Doubles, colours: Doubles | None, held_out: float, deviation: float | None
) -> CleanCloud:
    """Remove outliers and noise, bring the points into model space, and keep some of them for evaluation.

    points, normals: (N, 3), input space; normals of any length. colours: (N, 3) or None. held_out: share of the points
    to keep. deviation: standard deviation of the points, as a share of the shape's radius: of the largest distance from
    the centre of the bounding box. None: measured; 0: the points are exact, and all are used as they are.
    Raises UserError, without the file's name, where removing the noise leaves too few points.
    """
    directions = unit(normals)
    found = np.zeros(len(points), np.bool_) if deviation == 0 else outliers(points, directions)
    positions, centre, scale = normalise(points[~found])
    everything = SurfacePoints(positions, directions[~found], None if colours is None else colours[~found])
    order = np.random.default_rng(0).permutation(len(positions))
    split = max(1, int(len(positions) * held_out))
    kept, others = pick(everything, order[split:]), pick(everything, order[:split])
    amount = noise.measured(kept.points, kept.normals) if deviation is None else deviation
    if amount:
        parts = noise.smoothed(kept, others, amount)
        kept, others = (pick(part.surface, np.flatnonzero(part.supported)) for part in parts)
        if len(kept.points) < FEWEST_LEFT or not len(others.points):
            raise UserError(f"{len(kept.points)} points are left without a noise of {amount:.2g}; give another --noise")
        # The noise of the outermost points made the shape too large.
        _, offset, radius = normalise(np.concatenate((kept.points, others.points)))
        kept, others = _moved(kept, offset, radius), _moved(others, offset, radius)
        x, y, z = (float(c) for c in np.array(centre) + scale * np.array(offset))
        centre, scale, amount = (x, y, z), scale * radius, amount / radius
    removed = 1 - (len(kept.points) + len(others.points)) / len(points)
    record = {"deviation": amount, "measured": deviation is None, "outliers": removed} if amount or removed else {}
    if amount:
        kept = merge(kept).surface  # Points that lay above one another may end at one place.
    return CleanCloud(kept, others, centre, scale, amount, record)


def pick(surface: SurfacePoints, index: NDArray[np.int64]) -> SurfacePoints:
    """Return the points at an index (M,)."""
    colours = None if surface.colours is None else surface.colours[index]
    return SurfacePoints(surface.points[index], surface.normals[index], colours)


def _moved(surface: SurfacePoints, centre: tuple[float, float, float], scale: float) -> SurfacePoints:
    return SurfacePoints((surface.points - centre) / scale, surface.normals, surface.colours)
