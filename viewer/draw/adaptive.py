"""Where a picture wants more samples than one of a pixel, and how samples of any pixels are drawn close together."""

import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.samples import BLOCK, FEW, POWER, ROUGH_SHARE, SHARE, STEEPEST
from .supersampling import Image, jitters


def wanted(picture: Image, samples: int) -> NDArray[np.int64]:
    """Return how many samples each pixel (H, W) wants after its first: as it differs from its eight neighbours.

    That is at silhouettes, creases, edges of the texture, thin parts. picture: sRGB and coverage, one sample of a
    pixel. samples: most of a pixel, at least 1.
    """
    least = greatest = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    for axis in (0, 1):
        count = picture.shape[axis]
        least = np.minimum.reduce([np.take(least, range(k, k + count), axis) for k in range(3)])
        greatest = np.maximum.reduce([np.take(greatest, range(k, k + count), axis) for k in range(3)])
    wish = (greatest - least).max(axis=2).astype(np.float64) ** POWER
    covered = (picture[..., 3] > 0).sum()

    def is_too_much(steepness: float) -> bool:
        share = ROUGH_SHARE if steepness <= FEW else SHARE
        return bool(_counts(wish, steepness, samples).sum() > max(0.0, share * samples - 1) * covered)

    low, high = 0.0, STEEPEST
    if not is_too_much(high):
        return _counts(wish, high, samples)
    for _ in range(20):
        middle = (low + high) / 2
        low, high = (low, middle) if is_too_much(middle) else (middle, high)
    return _counts(wish, low, samples)


def _counts(wish: NDArray[np.float64], steepness: float, samples: int) -> NDArray[np.int64]:
    """Return the further samples (H, W) for numbers (H, W) that they are to follow: none, or two and more."""
    counts = np.minimum(wish * steepness, samples - 1).astype(np.int64)
    return np.where(counts == 1, 0, counts)


def places_of(
    counts: NDArray[np.int64], corner: tuple[int, int] = (0, 0)
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return the points (N, 2) of further samples of pixels, so many as `counts` (H, W) says, row by row.

    Those of a pixel are spread around its centre, where its first sample is: their mean must not lie elsewhere.
    corner: the pixel of the picture that (0, 0) is. The second result is the index (N,) of each point's pixel, as
    np.ravel counts.
    """
    each = counts.ravel()
    pixels = np.repeat(np.arange(each.size), each)
    number = np.arange(len(pixels)) - np.repeat(np.cumsum(each) - each, each)
    spread = np.concatenate([jitters(k) for k in range(1, max(2, int(each.max(initial=0)) + 1))])
    offsets = spread[np.repeat(each * (each - 1) // 2, each) + number]
    rows, columns = np.divmod(pixels, counts.shape[1])
    centres = np.stack([columns + corner[0], rows + corner[1]], axis=1).astype(np.float32) + np.float32(0.5)
    return np.asarray(centres + offsets), pixels


def add_samples(sums: Image, pixels: NDArray[np.int64], samples: NDArray[np.float32]) -> None:
    """Add samples (N, C) of pixels (N,), as `places_of` orders them, to `sums` (H, W, C) in place."""
    flat = sums.reshape(-1, sums.shape[2])
    for channel in range(flat.shape[1]):
        flat[:, channel] += np.bincount(pixels, samples[:, channel], len(flat)).astype(np.float32)


def into_blocks(values: NDArray[np.float32], widest: int) -> NDArray[np.float32]:
    """Lay values (N, C), N at least 1, out as (H, W, C), block by block; the last one fills what is left.

    widest: W is this at most. H and W are multiples of BLOCK.
    """
    blocks = -(-len(values) // BLOCK**2)
    across = min(widest // BLOCK, int(np.ceil(np.sqrt(blocks))))
    down = -(-blocks // across)
    missing = down * across * BLOCK**2 - len(values)
    filled = np.concatenate([values, np.repeat(values[-1:], missing, axis=0)])
    apart = filled.reshape(down, across, BLOCK, BLOCK, -1).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(apart.reshape(down * BLOCK, across * BLOCK, -1))


def from_blocks(image: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """Return the first `count` of the values (count, C) that `into_blocks` laid out as (H, W, C)."""
    height, width, _ = image.shape
    apart = image.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).transpose(0, 2, 1, 3, 4)
    return np.asarray(apart.reshape(height * width, -1)[:count])
