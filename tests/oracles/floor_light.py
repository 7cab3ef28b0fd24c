"""The openness of the floor between the corners of blocks of pixels, as floor_openness.glsl interpolates it."""

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

BEND = 0.16
"""Largest second difference between corners that are interpolated, in full light."""


def between(corners: Values, share: Values) -> tuple[Values, NDArray[np.bool_]]:
    """Interpolate the openness inside blocks of pixels.

    corners: (N, 4, 4, 3), `openness` of the corners from lower to upper and left to right, the middle four those of the
    block; NaN off the floor. share: (N, 2) position between them, from 0 to 1. Returns (N, 3), and whether the corners
    are nearly enough in a plane (N,).
    """
    x, y = share.T[:, :, None]
    lower, upper = ((1 - x) * corners[:, k, 1] + x * corners[:, k, 2] for k in (1, 2))
    bends = np.abs(np.diff(corners[:, 1:3, :, :2], 2, axis=2)), np.abs(np.diff(corners[:, :, 1:3, :2], 2, axis=1))
    found, bend = (1 - y) * lower + y * upper, np.maximum(*(bend.max(axis=(1, 2, 3)) for bend in bends))
    return found, bend < BEND * np.sqrt(found[:, :2].mean(axis=1))
