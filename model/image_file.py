"""Reads the image files that a user names, and writes PNG."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .files import show

if TYPE_CHECKING:
    from PIL.Image import Image


def open_image(path: Path, option: str) -> "Image":
    """Read an image as the file stores it. option: the option that names the file. Raises UserError."""
    from PIL import Image

    try:
        image = Image.open(path)
        image.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else "not a readable image"
        raise UserError(f"{option} {show(path)}: {reason}") from None
    return image


def png_bytes(pixels: NDArray[np.uint8], title: str = "", *, optimize: bool = False) -> bytes:
    """Encode pixels (H, W, 3 or 4), top row first, as a PNG file. optimize: smaller, for several times as long."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    if title:
        info.add_itxt("Title", title)
    info.add_text("Software", "mplicits")
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "png", pnginfo=info, optimize=optimize)
    return data.getvalue()
