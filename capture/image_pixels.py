"""Colors and masks of an image file."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from ..model.errors import UserError
from ..model.image_file import open_image
from .intrinsics import same_shape

OPAQUE = 128  # least alpha, or gray of a mask, of a pixel on the shape


def open_upright(path: Path, option: str) -> Image.Image:
    """Open an image, rotated as its EXIF says. Raises UserError with the option's name."""
    return ImageOps.exif_transpose(open_image(path, option))


def resized(picture: Image.Image, height: int, width: int, name: str) -> Image.Image:
    """Resize a picture to a depth map's size. name: for the UserError if the aspects differ."""
    if not same_shape(picture.size, (width, height)):
        raise UserError(
            f"{name}: {picture.width} x {picture.height}, the depth map {width} x {height}; the views differ"
        )
    if picture.size == (width, height):
        return picture
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def colors_of(picture: Image.Image) -> NDArray[np.uint8]:
    """Return the colors of a picture, (H, W, 3), sRGB."""
    return np.asarray(picture.convert("RGB"), np.uint8)


def opaque(picture: Image.Image) -> NDArray[np.bool_] | None:
    """Return the mask (H, W) of opaque pixels; None if the picture has no transparency."""
    if "A" not in picture.getbands() and "transparency" not in picture.info:
        return None
    return np.asarray(np.asarray(picture.convert("RGBA"))[..., 3] >= OPAQUE)


def mask_of(picture: Image.Image) -> NDArray[np.bool_]:
    """Return the mask (H, W) of a mask image: its opaque pixels, or without transparency its bright pixels."""
    by_alpha = opaque(picture)
    return np.asarray(np.asarray(picture.convert("L")) >= OPAQUE) if by_alpha is None or by_alpha.all() else by_alpha
