"""sRGB and linear light (IEC 61966-2-1), as glsl/functions/linear.glsl and glsl/functions/srgb.glsl convert them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.floating[Any]]


def to_linear(srgb: Values) -> Values:
    """Decode sRGB values in [0, 1], of any shape, to linear light."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: Values) -> Values:
    """Encode linear light in [0, 1], of any shape, as sRGB."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
