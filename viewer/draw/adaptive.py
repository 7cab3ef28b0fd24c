"""Adaptive sampling: how many further samples a pixel gets, and how scattered samples are packed into blocks."""

import numpy as np
from numpy.typing import NDArray

from ...codegen.targets.samples import BLOCK, PLENTY, POWER, SHARE, STEEPEST
from .supersampling import Image, jitters


def sample_counts(picture: Image, samples: int) -> NDArray[np.int64]:
    """Return the number of further samples of each pixel, (H, W), from its contrast with its eight neighbors.

    picture: (H, W, 4), sRGB and coverage, one sample per pixel. samples: largest number per pixel, at least 1.
    """
    low = high = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    for axis in (0, 1):
        count = picture.shape[axis]
        low = np.minimum.reduce([np.take(low, range(k, k + count), axis) for k in range(3)])
        high = np.maximum.reduce([np.take(high, range(k, k + count), axis) for k in range(3)])
    weights = (high - low).max(axis=2).astype(np.float64) ** POWER
    covered = (picture[..., 3] > 0).sum()

    def exceeds_share(factor: float) -> bool:
        most = SHARE * max(1.0, (PLENTY / factor) ** 2) * (samples - 1) * covered
        return bool(_counts(weights, factor, samples).sum() > most)

    least, most = 0.0, STEEPEST
    if not exceeds_share(most):
        return _counts(weights, most, samples)
    for _ in range(20):
        middle = (least + most) / 2
        least, most = (least, middle) if exceeds_share(middle) else (middle, most)
    return _counts(weights, least, samples)


def _counts(weights: NDArray[np.float64], factor: float, samples: int) -> NDArray[np.int64]:
    """Return whole numbers (H, W) proportional to the weights (H, W).

    One further sample cannot lie opposite a first one at the center: 1 becomes 0, except where 1 is the most.
    """
    counts = np.minimum(weights * factor, samples - 1).astype(np.int64)
    return np.where((counts == 1) & (samples > 2), 0, counts)


def first_offset(samples: int) -> NDArray[np.float32]:
    """Return the offset (1, 2) of every pixel's first sample, pixels. samples: largest number per pixel.

    It is the center; where there are two samples, they lie on opposite sides of it.
    """
    return jitters(2)[:1] if samples == 2 else jitters(1)


def sample_points(
    counts: NDArray[np.int64], corner: tuple[int, int] = (0, 0)
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return points (N, 2) in pixels, `counts` (H, W) of them in each pixel, and the flat pixel index (N,) of each.

    The points of a pixel are spread around its center, so that their mean does not shift the picture; a single point
    lies opposite `first_offset`. corner: the picture's pixel at `counts[0, 0]`.
    """
    each = counts.ravel()
    pixels = np.repeat(np.arange(each.size), each)
    number = np.arange(len(pixels)) - np.repeat(np.cumsum(each) - each, each)
    spread = np.concatenate([jitters(2)[1:], *(jitters(k) for k in range(2, int(each.max(initial=0)) + 1))])
    offsets = spread[np.repeat(each * (each - 1) // 2, each) + number]
    rows, columns = np.divmod(pixels, counts.shape[1])
    centers = np.stack([columns + corner[0], rows + corner[1]], axis=1).astype(np.float32) + np.float32(0.5)
    return np.asarray(centers + offsets), pixels


def add_samples(sums: Image, pixels: NDArray[np.int64], samples: NDArray[np.float32]) -> None:
    """Add samples (N, C) of the pixels (N,) from `sample_points` to `sums` (H, W, C) in place."""
    flat = sums.reshape(-1, sums.shape[2])
    for channel in range(flat.shape[1]):
        flat[:, channel] += np.bincount(pixels, samples[:, channel], len(flat)).astype(np.float32)


def into_blocks(values: NDArray[np.float32], widest: int) -> NDArray[np.float32]:
    """Arrange values (N, C), N > 0, as (H, W, C) in BLOCK x BLOCK squares; copies of the last value fill the rest.

    widest: upper bound of W. H and W are multiples of BLOCK.
    """
    blocks = -(-len(values) // BLOCK**2)
    across = min(widest // BLOCK, int(np.ceil(np.sqrt(blocks))))
    down = -(-blocks // across)
    missing = down * across * BLOCK**2 - len(values)
    filled = np.concatenate([values, np.repeat(values[-1:], missing, axis=0)])
    squares = filled.reshape(down, across, BLOCK, BLOCK, -1).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(squares.reshape(down * BLOCK, across * BLOCK, -1))


def from_blocks(image: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """Return the first `count` values, (count, C), of what `into_blocks` returned."""
    height, width, _ = image.shape
    squares = image.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).transpose(0, 2, 1, 3, 4)
    return np.asarray(squares.reshape(height * width, -1)[:count])
