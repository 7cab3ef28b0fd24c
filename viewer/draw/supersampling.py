"""Several samples of a pixel: where in the pixel they lie, and how their mean is taken in linear light."""

import numpy as np
from numpy.typing import NDArray

from ...model import srgb

Image = NDArray[np.float32]
"""A picture (H, W, 4): red, green, blue, alpha."""
GOLDEN_RATIO = 0.6180339887498949
"""(sqrt(5) - 1) / 2."""


def golden_order(count: int) -> NDArray[np.intp]:
    """Return the indices 0 to count - 1, (count,), by the golden ratio: neighbours in this order are far apart."""
    return np.argsort((0.5 + np.arange(count) * GOLDEN_RATIO) % 1.0)


def jitters(samples: int) -> NDArray[np.float32]:
    """Return the offsets (samples, 2) of a pixel's samples from its centre, in pixels, in [-0.5, 0.5), with mean 0.

    They lie like rooks that do not attack each other: every row and every column of a samples x samples board has one.
    """
    column = np.arange(samples)
    row = np.argsort(golden_order(samples))
    return np.asarray((np.stack([column, row], axis=1) + 0.5) / samples - 0.5, np.float32)


def to_linear(sample: Image, transparent: bool) -> Image:
    """Decode sRGB to linear light; alpha stays.

    transparent: multiply colours by alpha, so that the background does not count in a mean.
    """
    rgb, alpha = np.clip(sample[..., :3], 0, 1), sample[..., 3:]
    linear = srgb.to_linear(rgb)
    return np.concatenate([linear * alpha if transparent else linear, alpha], axis=-1, dtype=np.float32)


def from_linear(mean: NDArray[np.floating], transparent: bool) -> Image:
    """Encode linear light (H, W, 4) as sRGB; the inverse of `to_linear`."""
    linear, alpha = mean[..., :3], mean[..., 3:]
    if transparent:
        linear = np.clip(linear / np.maximum(alpha, 1e-6), 0, 1)
    rgb = srgb.to_srgb(linear)
    return np.concatenate([rgb, alpha], axis=-1, dtype=np.float32)
