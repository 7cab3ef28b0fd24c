"""The picture beside a depth map: its colours, and which pixels are of the shape."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from ..model.errors import UserError
from ..model.image_file import open_image
from .intrinsics import of_one_shape

SOLID = 128
"""Alpha, or grey of a mask, from which on a pixel is of the shape."""


def open_picture(path: Path, option: str) -> Image.Image:
    """Open a picture as a camera meant it to be seen. Raises UserError, one line that names the option."""
    return ImageOps.exif_transpose(open_image(path, option))


def fitted(picture: Image.Image, height: int, width: int, name: str) -> Image.Image:
    """Resize a picture to a depth map's size. Raises UserError where their shapes differ; name: of the picture."""
    if not of_one_shape(picture.size, (width, height)):
        raise UserError(
            f"{name}: {picture.width} x {picture.height}, the depth map {width} x {height}; these are not of one view"
        )
    if picture.size == (width, height):
        return picture
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def colours_of(picture: Image.Image) -> NDArray[np.uint8]:
    """Return the colours of a picture: (H, W, 3), sRGB."""
    return np.asarray(picture.convert("RGB"), np.uint8)


def solid(picture: Image.Image) -> NDArray[np.bool_] | None:
    """Tell which pixels (H, W) are not transparent; None where the picture has no transparency."""
    if "A" not in picture.getbands() and "transparency" not in picture.info:
        return None
    return np.asarray(np.asarray(picture.convert("RGBA"))[..., 3] >= SOLID)


def masked(picture: Image.Image) -> NDArray[np.bool_]:
    """Tell which pixels (H, W) of a mask are bright, or, where it has transparency, not transparent."""
    by_alpha = solid(picture)
    return np.asarray(np.asarray(picture.convert("L")) >= SOLID) if by_alpha is None or by_alpha.all() else by_alpha
