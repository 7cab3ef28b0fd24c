"""Reads the image files that a user names, and writes PNG."""

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .files import note_input, reason_of, regular, show, silent_library
from .kinds import MARK
from .memory import check_claim, check_memory

if TYPE_CHECKING:
    from PIL.Image import Image


BYTES = 24
"""Memory that a pixel of an image takes, as bytes and as converted copies."""

DECODED = ("AVIF", "BMP", "DDS", "GIF", "JPEG", "JPEG2000", "MPO", "PNG", "PPM", "TGA", "TIFF", "WEBP")
"""Formats that Pillow decodes itself. It would start other programs for some others, such as Ghostscript for EPS.

Not ICO, whose pixels it decodes before its size is known."""
MOST_SCANS = 64
"""Most scans of a JPEG: programs write ten, but a short file may have thousands, each as long as a picture takes."""
MARKER = re.compile(rb"\xff([\x01-\xcf\xd8-\xfe])")
"""Of a part of a JPEG; 0, D0 to D7 and FF are none, in its pixels."""
END, SCAN, BARE = 0xD9, 0xDA, (0x01, 0xD8)
"""Markers of a JPEG: its end, a scan, and others without a length."""


def opened_image(source: "Path | BinaryIO") -> "Image":
    """Open an image of one of the formats `DECODED`: its header is read. Raises what Pillow does."""
    from PIL import Image

    Image.init()
    return Image.open(source, formats=[name for name in DECODED if name in Image.OPEN])


def load_pixels(image: "Image") -> None:
    """Decode an image of `opened_image`, whose size is checked. Raises what Pillow does."""
    file = getattr(image, "fp", None)
    if image.format in ("JPEG", "MPO") and file is not None:
        file.seek(0)
        if _scans(file.read()) > MOST_SCANS:
            raise ValueError("a JPEG of too many scans")
    with silent_library():  # libtiff prints its warnings
        image.load()


def _scans(data: bytes) -> int:
    """Count the scans of a JPEG, up to its end: what follows may be another picture, or a video."""
    at, count = 0, 0
    while (found := MARKER.search(data, at)) is not None and found[1][0] != END:
        kind, at = found[1][0], found.end()
        if kind not in BARE:
            at += int.from_bytes(data[at : at + 2], "big")
        count += kind == SCAN
    return count


def open_image(path: Path, option: str) -> "Image":
    """Read an image as the file stores it. option: the option that names the file. Raises UserError."""
    from PIL import Image

    try:
        image = opened_image(regular(path))
        needed = BYTES * image.width * image.height
        check_claim(needed, f"{option} {show(path)}", path.stat().st_size)
        check_memory(needed, f"{option} {show(path)}", "shrink it")
        load_pixels(image)
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
