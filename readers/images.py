"""Finds and loads the images of materials."""

import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from ..model.errors import UserError
from ..model.files import regular, show
from ..model.image_file import open_image
from .paint import Picture

Image.MAX_IMAGE_PIXELS = 2**30
"""Pillow's limit against decompression bombs; textures of 32,768 pixels a side are legitimate."""
UNREADABLE = (OSError, ValueError, SyntaxError, Image.DecompressionBombError)


@dataclass(frozen=True)
class Missing:
    """An image that is not there, or not readable."""

    name: str
    """Name that was looked for; "" if the file names none."""
    why: str = "not found beside the file"

    def line(self) -> str:
        """Return the warning."""
        named = f" ({show(self.name)}: {self.why})" if self.name else ""
        return f"texture coordinates, but no readable image{named}; name it with --texture FILE"


def find(folder: Path, name: str) -> Path | None:
    """Find the file that a material names: at its path, or by its last part beside the file, in any case."""
    if not name or "\0" in name:
        return None
    parts = [part for part in re.split(r"[\\/]+", name) if part not in ("", ".")]
    if not parts:
        return None
    try:
        for path in (folder.joinpath(*parts), Path(name), folder / parts[-1]):
            if path.is_file():
                return path
        for place in (folder.joinpath(*parts[:-1]), folder):
            if place.is_dir():
                wanted = parts[-1].lower()
                found = sorted(path for path in place.iterdir() if path.name.lower() == wanted and path.is_file())
                if found:
                    return found[0]
    except (OSError, ValueError):
        pass
    return None


def load_picture(folder: Path, name: str, image: Path | None, *, unwrapped: bool = True) -> Picture | None:
    """Load the image that the user names, or else the one that a file names; None if that is not readable.

    Raises UserError where the user's image cannot be used, for a mesh without texture coordinates (not `unwrapped`),
    and for 16-bit gray and floats, which Pillow would clip to white or black.
    """
    if image is not None:
        if not unwrapped:
            raise UserError(f"--texture {show(image)}: the mesh has no texture coordinates")
        return picture_of(open_image(image, "--texture"))
    path = find(folder, name)
    return None if path is None else decoded(path)


def decoded(source: Path | bytes) -> Picture | None:
    """Decode an image; None if it is not readable. Raises UserError as `load_picture` does."""
    try:
        with Image.open(io.BytesIO(source) if isinstance(source, bytes) else regular(source)) as opened:
            opened.load()
            return picture_of(opened)
    except UNREADABLE:
        return None


def picture_of(image: Image.Image) -> Picture:
    """Convert an image to 8 bits of red, green and blue. Raises UserError."""
    if image.mode.startswith("I") or image.mode == "F":
        raise UserError("an image of 16-bit gray or of floats; save it with 8 bits a channel, or --texture none")
    return Picture(np.asarray(image.convert("RGB"), np.uint8))
