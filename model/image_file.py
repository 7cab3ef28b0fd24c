"""Reading a picture that the user names."""

from pathlib import Path
from typing import TYPE_CHECKING

from .errors import UserError
from .files import show

if TYPE_CHECKING:
    from PIL.Image import Image


def open_image(path: Path, option: str) -> "Image":
    """Read a picture as it is in its file. option: that named it, for the one line of the UserError where it cannot."""
    from PIL import Image

    try:
        image = Image.open(path)
        image.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else "not a readable image"
        raise UserError(f"{option} {show(path)}: {reason}") from None
    return image
