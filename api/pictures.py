"""Pictures of models without OpenGL: for notebooks, and of a training's levels in a folder (`train --preview`)."""

from pathlib import Path

from ..model.errors import UserError
from ..model.files import check_writable, show, write_whole
from ..model.image_file import png_bytes
from ..model.kinds import PICTURE
from ..model.model import Model
from ..web import page as webpage

SIDE = 320
"""Pixels of a picture, along each side."""


def png(model: Model) -> bytes:
    """Draw a model from its front: a PNG with a transparent background."""
    return png_bytes(webpage.poster_pixels(model, SIDE), optimize=True)


class Pictures:
    """A folder that gets a picture of every level of a training: NAME-1.png, ..., and NAME-2-colours.png at the end."""

    def __init__(self, folder: Path) -> None:
        """Make the folder where it is not there. Raises UserError where it cannot be."""
        self._folder, self._drawn = folder, set[Path]()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"--preview {show(folder)}: {error.strerror}; name a folder") from None

    def draw(self, model: Model) -> None:
        """Draw a model, unless it is the one that was drawn last. Raises UserError where there is no place for it."""
        name = "".join(c if c.isalnum() else "-" for c in Path(model.name).stem)[:60]
        coloured = "" if model.texture is None else "-colours"
        path = self._folder / f"{name}-{len(model.levels)}{coloured}.png"
        if path not in self._drawn:
            self._drawn.add(path)
            check_writable(path, kind=PICTURE)
            write_whole(path, png(model))
