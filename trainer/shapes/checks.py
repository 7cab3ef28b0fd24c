"""What the numbers of an input must be for anything to be computed from them.

The errors lack the file's name, which `load_shape` puts first.
"""

import numpy as np

from ...model.errors import UserError
from .shape import Doubles

LARGEST = 1e100
"""Largest coordinate: the squares and cubes of larger ones are soon no numbers."""
SMALLEST = 1e-100
"""Smallest extent, for the same reason."""
FEWEST = 100
"""Fewest points of a cloud."""


def check_coordinates(points: Doubles) -> None:
    """Raise UserError where coordinates are not (N, 3), not finite, or out of the range that can be computed with."""
    if points.ndim != 2 or points.shape[1] != 3:
        raise UserError(f"points of {points.shape[-1]} coordinates; three are needed")
    if not np.isfinite(points).all():
        raise UserError("coordinates that are not finite (NaN or infinity); repair the file")
    largest = float(np.abs(points).max(initial=0.0))
    if largest > LARGEST:
        raise UserError(
            f"coordinates as large as {largest:.2g}; at most {LARGEST:g} can be computed with: scale it down"
        )
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if 0 < extent < SMALLEST:
        raise UserError(f"an extent of only {extent:.2g}; at least {SMALLEST:g} can be computed with: scale it up")


def check_cloud(points: Doubles, normals: Doubles | None, colours: Doubles | None) -> None:
    """Raise UserError where a cloud cannot be used: points (N, 3), normals and colours (N, 3) or None."""
    if len(points) < FEWEST:
        raise UserError(f"{len(points)} points; a cloud needs at least {FEWEST}")
    check_coordinates(points)
    if not np.ptp(points, axis=0).max() > 0:
        raise UserError("all points are one point; nothing to train on")
    if normals is not None:
        _check_normals(normals)
    if colours is not None and not np.isfinite(colours).all():
        raise UserError("colours that are not finite (NaN or infinity); repair the file, or leave the colours out")


def _check_normals(normals: Doubles) -> None:
    """Raise UserError where normals (N, 3) are none, or are too long."""
    if not np.isfinite(normals).all():
        raise UserError("normals that are not finite (NaN or infinity); repair the file")
    with np.errstate(over="ignore", under="ignore"):
        lengths = np.linalg.norm(normals, axis=1)
    if not (lengths > 0).all():
        raise UserError("normals of length zero; a cloud needs a normal at every point")
    if not np.isfinite(lengths).all():
        raise UserError("normals too long to compute with; make them unit vectors")
