"""Loads the images of materials: each once, as large as its bytes and the budget allow."""

import hashlib
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..model.errors import UserError
from ..model.files import show
from ..model.image_file import load_pixels, open_image, opened_image
from ..model.references import MISSING, UnresolvedError
from .claims import Claims
from .named_files import NamedFiles
from .paint import Picture

Image.MAX_IMAGE_PIXELS = 2**30
"""Pillow's limit against decompression bombs; textures of 32,768 pixels a side are legitimate."""
UNREADABLE = (OSError, ValueError, SyntaxError, Image.DecompressionBombError)
KEPT, DECODING = 3, 12
"""Bytes of a pixel: as it stays, and of what there is besides while it is decoded and converted."""


@dataclass(frozen=True)
class Missing:
    """An image that is not there, or not readable."""

    name: str
    """Name that was looked for; "" if the file names none."""
    why: str = MISSING

    def line(self) -> str:
        """Return the warning."""
        named = f" ({show(self.name)}: {self.why})" if self.name else ""
        return f"texture coordinates, but no readable image{named}; name it with --texture FILE"


def users_picture(image: Path, *, unwrapped: bool) -> Picture:
    """Load the image that the user names. Raises UserError where the mesh is not `unwrapped`, and as `picture_of`."""
    if not unwrapped:
        raise UserError(f"--texture {show(image)}: the mesh has no texture coordinates")
    return picture_of(open_image(image, "--texture"))


class Images:
    """The images of one file. What is not readable is not looked at twice, either."""

    def __init__(self, claims: Claims) -> None:
        """claims: of the file."""
        self._claims = claims
        self._pixels: dict[Path | bytes, NDArray[np.uint8] | None] = {}

    def named(self, files: NamedFiles, name: str) -> Picture:
        """Load the image that a material names. Raises UnresolvedError, and UserError as `picture_of` does."""
        path = files.file(name)
        if path not in self._pixels:
            try:
                data = self._claims.read(path)
            except OSError:
                raise UnresolvedError(name, MISSING) from None
            picture = self.decoded(data)
            self._pixels[path] = None if picture is None else picture.pixels
        if (pixels := self._pixels[path]) is None:
            raise UnresolvedError(name, "not a readable image")
        return Picture(pixels)

    def decoded(self, data: bytes) -> Picture | None:
        """Decode an image; None if it is not readable. Raises UserError as `picture_of`, and where it is too large."""
        key = hashlib.sha256(data).digest()
        if key not in self._pixels:
            self._pixels[key] = self._decode(data)
        pixels = self._pixels[key]
        return None if pixels is None else Picture(pixels)

    def _decode(self, data: bytes) -> NDArray[np.uint8] | None:
        try:
            with opened_image(io.BytesIO(data)) as opened:
                width, height = opened.size
                size = width * height
                self._claims.take(KEPT * size, f"an image of {width:,} x {height:,} pixels", DECODING * size)
                load_pixels(opened)
                return picture_of(opened).pixels
        except UNREADABLE:
            return None


def picture_of(image: Image.Image) -> Picture:
    """Convert an image to 8 bits of red, green and blue. Raises UserError."""
    if image.mode.startswith("I") or image.mode == "F":
        raise UserError("an image of 16-bit gray or of floats; save it with 8 bits a channel, or --texture none")
    return Picture(np.asarray(image.convert("RGB"), np.uint8))
