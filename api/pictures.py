"""Pictures of models without OpenGL, for notebooks and for `train --preview`."""

from collections.abc import Callable
from pathlib import Path

from ..model.errors import UserError
from ..model.files import check_writable, show, write_whole
from ..model.image_file import png_bytes
from ..model.kinds import PICTURE
from ..model.model import Model
from ..web.page import poster_pixels

SIDE = 320
"""Width and height of a picture, pixels."""


def png(model: Model) -> bytes:
    """Draw a model from its front: a PNG with a transparent background."""
    return png_bytes(poster_pixels(model, SIDE), optimize=True)


def file_name(name: str) -> str:
    """Replace characters that are not safe in file names."""
    return "".join(c if c.isalnum() else "-" for c in name)[:60]


def pictures(folder: Path) -> Callable[[Model], None]:
    """Return a function that draws a model into `folder`, once for each level of a training.

    The files are NAME-1.png, ..., and NAME-2-colors.png at the end. Makes the folder if it does not exist. Both
    functions raise UserError if the system refuses a path.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--preview {show(folder)}: {error.strerror}; name a folder") from None
    written = set[Path]()

    def draw(model: Model) -> None:
        suffix = "" if model.texture is None else "-colors"
        path = folder / f"{file_name(Path(model.name).stem)}-{len(model.levels)}{suffix}.png"
        if path not in written:
            written.add(path)
            check_writable(path, kind=PICTURE, force=None)
            write_whole(path, png(model))

    return draw
