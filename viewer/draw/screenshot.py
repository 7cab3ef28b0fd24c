"""Rounds float pictures to 8 bits, and writes them as PNG files."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from ...model.files import show, write_whole
from ...model.image_file import png_bytes


def save_png(path: Path, image: NDArray[np.float32], title: str = "", transparent: bool = False) -> None:
    """Write a PNG file, whole or not at all; the other arguments are those of `to_png`. Raises UserError."""
    check_name(path)
    write_whole(path, to_png(image, title, transparent))


def to_png(image: NDArray[np.float32], title: str = "", transparent: bool = False) -> bytes:
    """Encode an image as an 8-bit PNG file; without alpha, colors are dithered.

    image: (H, W, 4), sRGB and alpha, clipped to [0, 1], top row first. title: a text in the file. transparent: keep
    alpha.
    """
    return png_bytes(to_bytes(image if transparent else image[..., :3], dithered=not transparent), title)


def to_bytes(image: NDArray[np.float32], dithered: bool = True) -> NDArray[np.uint8]:
    """Clip an image (H, W, channels) to [0, 1], and round it to 8 bits. dithered: against color bands."""
    pixels = np.empty(image.shape, np.uint8)
    for y, (row, out) in enumerate(zip(image, pixels, strict=True)):  # row by row: an 8K picture is large
        noise = _dither(y, len(row)) if dithered else 0.0
        out[:] = np.rint(np.clip(row, 0.0, 1.0) * 255.0 + noise)
    return pixels


def _dither(y: int, width: int) -> NDArray[np.float32]:
    """Return the dither of a row of pixels, (width, 1): 255 times dither.glsl, below 0.5 in magnitude."""
    phase = 0.06711056 * (np.arange(width) + 0.5) + 0.00583715 * (y + 0.5)
    noise = np.modf(52.9829189 * np.modf(phase)[0])[0] - 0.5
    return np.asarray(0.998 * noise, np.float32)[:, None]


def check_name(path: Path) -> None:
    """Raise UserError unless the path ends in .png."""
    if path.suffix.lower() in (".mp4", ".gif"):
        raise UserError(f"{show(path)}: a video needs --frames N, the number of its pictures")
    if path.suffix.lower() != ".png":
        raise UserError(f"{show(path)}: pictures are PNG; name it .png")
