"""Writes float images as PNG files."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from ...model.files import show, write_whole
from ...model.image_file import png_bytes


def save_png(path: Path, image: NDArray[np.float32], title: str = "", transparent: bool = False) -> None:
    """Write an image as a PNG file, whole or not at all; the arguments after `path` are those of `to_png`.

    Raises UserError where `path` cannot be written or does not end in .png.
    """
    check_name(path)
    write_whole(path, to_png(image, title, transparent))


def to_png(image: NDArray[np.float32], title: str = "", transparent: bool = False) -> bytes:
    """Encode an image as the bytes of an 8-bit PNG file.

    image: (H, W, 4) float32, sRGB and alpha, [0, 1], top row first; what lies outside is clipped. title: a text that
    the file holds, "" for none. transparent: keeps alpha. Without alpha, colours are dithered.
    """
    return png_bytes(to_bytes(image if transparent else image[..., :3], dithered=not transparent), title)


def to_bytes(image: NDArray[np.float32], dithered: bool = True) -> NDArray[np.uint8]:
    """Round an image (H, W, channels) in [0, 1] to 8 bits; what lies outside is clipped. dithered: against bands."""
    pixels = np.empty(image.shape, np.uint8)
    for y, (row, out) in enumerate(zip(image, pixels, strict=True)):  # an 8K picture fits the memory only once
        noise = _dither(y, len(row)) if dithered else 0.0
        out[:] = np.rint(np.clip(row, 0.0, 1.0) * 255.0 + noise)
    return pixels


def _dither(y: int, width: int) -> NDArray[np.float32]:
    """Return what is added to a row of pixels, (width, 1), before it is rounded (glsl/dither.glsl, times 255).

    It is less than a half either way, so that a colour of 8 bits stays as it is.
    """
    phase = 0.06711056 * (np.arange(width) + 0.5) + 0.00583715 * (y + 0.5)
    noise = np.modf(52.9829189 * np.modf(phase)[0])[0] - 0.5
    return np.asarray(0.998 * noise, np.float32)[:, None]


def check_name(path: Path) -> None:
    """Raise UserError where `path` does not end in .png."""
    if path.suffix.lower() in (".mp4", ".gif"):
        raise UserError(f"{show(path)}: a video needs --frames N, the number of its pictures")
    if path.suffix.lower() != ".png":
        raise UserError(f"{show(path)}: pictures are PNG; name it .png")
