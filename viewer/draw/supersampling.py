"""The positions of a pixel's samples, and their mean in linear light."""

import numpy as np
from numpy.typing import NDArray

from ...model import srgb

Image = NDArray[np.float32]
"""A picture (H, W, 4): red, green, blue, alpha."""
GOLDEN_RATIO = 0.6180339887498949
"""(sqrt(5) - 1) / 2."""


def golden_order(count: int) -> NDArray[np.intp]:
    """Return 0 to count - 1, (count,), in an order by the golden ratio that keeps neighbors far apart."""
    return np.argsort((0.5 + np.arange(count) * GOLDEN_RATIO) % 1.0)


def jitters(samples: int) -> NDArray[np.float32]:
    """Return the offsets (samples, 2) of a pixel's samples from its center, pixels, in [-0.5, 0.5), with mean 0.

    On a samples x samples grid, every row and every column has exactly one sample.
    """
    column = np.arange(samples)
    row = np.argsort(golden_order(samples))
    return np.asarray((np.stack([column, row], axis=1) + 0.5) / samples - 0.5, np.float32)


def to_linear(sample: Image, transparent: bool) -> Image:
    """Decode sRGB to linear light. transparent: premultiply colors by alpha, so that a mean omits the background."""
    rgb, alpha = np.clip(sample[..., :3], 0, 1), sample[..., 3:]
    linear = srgb.to_linear(rgb)
    return np.concatenate([linear * alpha if transparent else linear, alpha], axis=-1, dtype=np.float32)


def from_linear(mean: NDArray[np.floating], transparent: bool) -> Image:
    """Encode linear light (H, W, 4) as sRGB: the inverse of `to_linear`."""
    linear, alpha = mean[..., :3], mean[..., 3:]
    if transparent:
        linear = np.clip(linear / np.maximum(alpha, 1e-6), 0, 1)
    return np.concatenate([srgb.to_srgb(linear), alpha], axis=-1, dtype=np.float32)
