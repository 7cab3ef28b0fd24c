"""Writes float images as PNG files."""

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from ...model.errors import UserError
from ...model.files import show, write_whole


def save_png(path: Path, image: NDArray[np.float32], title: str = "", transparent: bool = False) -> None:
    """Write an image as a PNG file, whole or not at all; the arguments after `path` are those of `to_png`.

    Raises UserError where `path` cannot be written or does not end in .png.
    """
    check_name(path)
    write_whole(path, to_png(image, title, transparent))


def to_png(image: NDArray[np.float32], title: str = "", transparent: bool = False) -> bytes:
    """Encode an image as the bytes of an 8-bit PNG file.

    image: (H, W, 4) float32, sRGB and alpha, [0, 1], top row first; what lies outside is clipped. title: a text that
    the file holds, "" for none. transparent: keeps alpha.
    """
    channels = image if transparent else image[..., :3]
    pixels = np.empty(channels.shape, np.uint8)
    for row, out in zip(channels, pixels, strict=True):  # row by row: an 8K picture fits the memory only once
        out[:] = np.rint(np.clip(row, 0.0, 1.0) * 255.0)
    info = PngInfo()
    if title:
        info.add_itxt("Title", title)
    info.add_text("Software", "mplicits")
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "png", pnginfo=info)
    return data.getvalue()


def check_name(path: Path) -> None:
    """Raise UserError where `path` does not end in .png."""
    if path.suffix.lower() != ".png":
        raise UserError(f"{show(path)}: pictures are PNG; name it .png")
