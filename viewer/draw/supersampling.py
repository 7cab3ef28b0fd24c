"""Several samples of a pixel: where they lie, and their mean in linear light."""

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]
"""(H, W, 4)."""


def jitters(samples: int) -> NDArray[np.float32]:
    """(samples, 2) offsets from the pixel's centre, in pixels, mean 0: rooks' places, ordered by the golden ratio."""
    rank = np.argsort(np.argsort((0.5 + np.arange(samples) * 0.6180339887498949) % 1.0))
    return np.asarray((np.stack([np.arange(samples), rank], axis=1) + 0.5) / samples - 0.5, np.float32)


def to_linear(sample: Image, transparent: bool) -> Image:
    """Decodes sRGB (IEC 61966-2-1); premultiplied by alpha where the background is to be left out."""
    rgb, alpha = np.clip(sample[..., :3], 0, 1), sample[..., 3:]
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return np.concatenate([linear * alpha if transparent else linear, alpha], axis=-1, dtype=np.float32)


def from_linear(mean: NDArray[np.floating], transparent: bool) -> Image:
    """Encodes sRGB: undoes `to_linear`."""
    linear, alpha = mean[..., :3], mean[..., 3:]
    if transparent:
        linear = np.clip(linear / np.maximum(alpha, 1e-6), 0, 1)
    rgb = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.concatenate([rgb, alpha], axis=-1, dtype=np.float32)
