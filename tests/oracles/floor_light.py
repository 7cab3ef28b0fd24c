"""The openness of the floor between the corners of blocks of pixels, as glsl/floor_light.glsl interpolates it."""

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

SPREAD = 0.05
"""Largest difference between corners that are interpolated."""


def between(corners: Values, share: Values) -> tuple[Values, NDArray[np.bool_]]:
    """Interpolate the openness inside blocks of pixels.

    corners: (N, 4, 3), `openness` of the lower left, lower right, upper left and upper right corner; NaN off the floor.
    share: (N, 2) position between them, from 0 to 1. Returns (N, 3), and whether the corners are alike enough (N,).
    """
    x, y = share.T[:, :, None]
    lower, upper = ((1 - x) * corners[:, k] + x * corners[:, k + 1] for k in (0, 2))
    spread = np.ptp(corners[..., :2], axis=1).max(axis=1)
    return (1 - y) * lower + y * upper, spread < SPREAD
