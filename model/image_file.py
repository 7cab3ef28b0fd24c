"""Reads the image files that a user names, and writes PNG."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .files import note_input, reason_of, regular, show
from .kinds import MARK
from .memory import check_claim, check_memory

if TYPE_CHECKING:
    from PIL.Image import Image


BYTES = 24
"""Memory that a pixel of an image takes, as bytes and as converted copies."""

DECODED = ("AVIF", "BMP", "DDS", "GIF", "ICO", "JPEG", "JPEG2000", "MPO", "PNG", "PPM", "TGA", "TIFF", "WEBP")
"""Formats that Pillow decodes itself. It would start other programs for some others, such as Ghostscript for EPS."""


def opened_image(source: "Path | BinaryIO") -> "Image":
    """Open an image of one of the formats `DECODED`: its header is read. Raises what Pillow does."""
    from PIL import Image

    Image.init()
    return Image.open(source, formats=[name for name in DECODED if name in Image.OPEN])


def open_image(path: Path, option: str) -> "Image":
    """Read an image as the file stores it. option: the option that names the file. Raises UserError."""
    from PIL import Image

    try:
        image = opened_image(regular(path))
        needed = BYTES * image.width * image.height
        check_claim(needed, f"{option} {show(path)}", path.stat().st_size)
        check_memory(needed, f"{option} {show(path)}", "shrink it")
        image.load()
        note_input(path)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise UserError(f"{option} {show(path)}: {reason_of(error, 'not a readable image')}") from None
    return image


def png_bytes(pixels: NDArray[np.uint8], title: str = "", *, optimize: bool = False) -> bytes:
    """Encode pixels (H, W, 3 or 4), top row first, as a PNG file. optimize: smaller, for several times as long."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    if title:
        info.add_itxt("Title", title)
    info.add_text("Software", MARK)
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "png", pnginfo=info, optimize=optimize)
    return data.getvalue()
