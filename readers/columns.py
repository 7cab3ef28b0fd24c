"""The columns of points as arrays: joined by their roles, and colors by their units and ranges."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from .values import Doubles

PACKED = ("rgb", "rgba")
"""Names of PCL's columns with a color in the bits of a number."""
LARGEST = {1: 255.0, 2: 65535.0}
"""Bytes of a whole number -> its largest value as a color."""


def stacked(columns: Sequence[NDArray[Any]], roles: Mapping[str, int], wanted: str) -> NDArray[Any] | None:
    """Join the columns of three roles: (N, 3) of their own type; None if one is missing. wanted: "nx ny nz"."""
    places = [roles.get(role) for role in wanted.split()]
    if any(place is None for place in places):
        return None
    return np.stack([np.asarray(columns[place]).reshape(-1) for place in places if place is not None], axis=1)


def typed_colors(values: NDArray[Any]) -> Doubles:
    """Convert colors (N, 3) to [0, 1] by their type: floats as they are, whole numbers over their largest value.

    Raises UserError for floats above 1, and for whole numbers of other sizes than 1 or 2 bytes that fit neither.
    """
    if values.dtype.kind in "iu":
        largest = LARGEST.get(values.dtype.itemsize) if values.dtype.kind == "u" else None
        if largest == LARGEST[2] and values.max(initial=0) <= LARGEST[1]:
            largest = LARGEST[1]  # bytes in 16 bits: they would be black
        return values / (largest or _range_of(values.astype(np.float64)))
    found = values.astype(np.float64)
    finite = found[np.isfinite(found)]
    if len(finite) and (finite.max() > 1 + 1e-3 or finite.min() < -1e-3):
        raise UserError(
            f"colors from {finite.min():.4g} to {finite.max():.4g} in columns of floats; they go from 0 to 1: "
            "divide them, or store bytes"
        )
    return found if len(finite) < found.size else np.clip(found, 0, 1)


def untyped_colors(values: Doubles) -> Doubles:
    """Convert colors (N, 3) of a text to [0, 1] by their range: up to 1, to 255, or to 65,535. Raises UserError."""
    return np.asarray(values / _range_of(values))


def _range_of(values: Doubles) -> float:
    """Return the largest value of the range that colors (N, 3) are in. Raises UserError."""
    finite = values[np.isfinite(values)]
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 0.0)
    if low < 0 or high > 65535:
        raise UserError(f"colors from {low:.4g} to {high:.4g}; they go from 0 to 1, to 255, or to 65,535")
    return 1.0 if high <= 1 else 255.0 if high <= 255 else 65535.0


def unpacked(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Read colors (N, 3) in the bits of numbers (N,): 0xRRGGBB, as PCL stores them in floats or whole numbers."""
    bits = values.astype("<f4").view("<u4") if values.dtype.kind == "f" else values.astype(np.uint32)
    return np.stack([bits >> shift & 255 for shift in (16, 8, 0)], axis=1).astype(np.uint8)
