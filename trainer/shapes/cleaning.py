"""Prepares a point cloud for training: removes outliers and noise, normalizes it, and holds points out."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...model.errors import UserError
from . import noise
from .duplicates import merge
from .outliers import outliers
from .shape import SurfacePoints, as_triple, normalize, unit

FEWEST_LEFT = 50  # fewest points that the removal of noise must leave for training


@dataclass(frozen=True, eq=False)
class CleanCloud:
    """A cloud in model space."""

    training: SurfacePoints
    held_out: SurfacePoints
    """Points for evaluation, which do not influence `training`."""
    center: tuple[float, float, float]
    scale: float
    noise: float
    """Standard deviation of the removed noise, model units; 0 for exact points."""
    record: dict[str, Any]
    """The provenance's `noise` entry; empty if there was neither noise nor an outlier."""


def clean(cloud: SurfacePoints, held_out: float, deviation: float | None) -> CleanCloud:
    """Remove outliers and noise, normalize the points, and hold some of them out for evaluation.

    cloud: in input space; its normals may have any length. held_out: share of the points to hold out. deviation:
    standard deviation of the noise, as a share of the largest distance from the center of the bounding box; None:
    measure it; 0: use all points unchanged.
    Raises UserError, without the file's name, if too few points are left.
    """
    cloud = replace(cloud, normals=unit(cloud.normals))
    outlier = np.zeros(len(cloud.points), np.bool_) if deviation == 0 else outliers(cloud.points, cloud.normals)
    inliers = cloud.take(~outlier)
    positions, center, scale = normalize(inliers.points)
    inliers = SurfacePoints(positions, inliers.normals, inliers.colors)
    order = np.random.default_rng(0).permutation(len(positions))
    split = max(1, int(len(positions) * held_out))
    training, others = inliers.take(order[split:]), inliers.take(order[:split])
    amount = noise.measured(training.points, training.normals) if deviation is None else deviation
    if amount:
        parts = noise.smoothed(training, others, amount)
        training, others = (part.surface.take(np.flatnonzero(part.supported)) for part in parts)
        if len(training.points) < FEWEST_LEFT or not len(others.points):
            raise UserError(
                f"{len(training.points)} points are left after removing noise of {amount:.2g}; set another --noise"
            )
        # The noise of the outermost points made the shape too large.
        _, offset, radius = normalize(np.concatenate((training.points, others.points)))
        training, others = _moved(training, offset, radius), _moved(others, offset, radius)
        center = as_triple(np.array(center) + scale * np.array(offset))
        scale, amount = scale * radius, amount / radius
    removed = 1 - (len(training.points) + len(others.points)) / len(cloud.points)
    record = {"deviation": amount, "measured": deviation is None, "outliers": removed} if amount or removed else {}
    if amount:
        training = merge(training).surface  # smoothing can move two points to one place
    return CleanCloud(training, others, center, scale, amount, record)


def _moved(surface: SurfacePoints, center: tuple[float, float, float], scale: float) -> SurfacePoints:
    return SurfacePoints((surface.points - center) / scale, surface.normals, surface.colors)
