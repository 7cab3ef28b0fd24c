"""Checks the numbers of an input. The errors lack the file's name, which `name_first` prepends."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ...model.errors import UserError
from .shape import Doubles

LARGEST, SMALLEST = 1e100, 1e-100
"""Largest coordinate and smallest extent: squares and cubes beyond them overflow or vanish."""
FEWEST = 100  # fewest points of a cloud


def check_coordinates(points: Doubles) -> None:
    """Raise UserError unless coordinates are (N, 3), finite, and in the range of LARGEST and SMALLEST."""
    if points.ndim != 2 or points.shape[1] != 3:
        raise UserError(f"points have {points.shape[-1]} coordinates; three are needed")
    if not np.isfinite(points).all():
        raise UserError("coordinates are not finite (NaN or infinity); repair the file")
    largest = float(np.abs(points).max(initial=0.0))
    if largest > LARGEST:
        raise UserError(f"coordinates as large as {largest:.2g}; the limit is {LARGEST:g}: scale it down")
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if 0 < extent < SMALLEST:
        raise UserError(f"an extent of only {extent:.2g}; the limit is {SMALLEST:g}: scale it up")


def check_cloud(points: Doubles, normals: Doubles | None, colors: Doubles | None) -> None:
    """Raise UserError unless training can use the points (N, 3), with their normals and colors (N, 3)."""
    check_count(len(points), "points")
    check_coordinates(points)
    if not np.ptp(points, axis=0).max() > 0:
        raise UserError("all points are one point; nothing to train on")
    if normals is not None:
        _check_normals(normals)
    if colors is not None and not np.isfinite(colors).all():
        raise UserError("colors are not finite (NaN or infinity); repair the file, or remove the colors")


def check_count(count: int, what: str) -> None:
    """Raise UserError if a cloud has fewer than FEWEST points."""
    if count < FEWEST:
        raise UserError(f"{count} {what}; a cloud needs at least {FEWEST}")


def _check_normals(normals: Doubles) -> None:
    if not np.isfinite(normals).all():
        raise UserError("normals are not finite (NaN or infinity); repair the file")
    with np.errstate(over="ignore", under="ignore"):
        lengths = np.linalg.norm(normals, axis=1)
    if not (lengths > 0).all():
        raise UserError("normals of length zero; a cloud needs a normal at every point")
    if not np.isfinite(lengths).all():
        raise UserError("normals are too long to compute with; make them unit vectors")


@contextmanager
def name_first(name: str) -> Iterator[None]:
    """Prepend a name and a colon to the message of any UserError."""
    try:
        yield
    except UserError as error:
        raise UserError(f"{name}: {error}") from None
