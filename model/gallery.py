"""The gallery: models that come with the package. A name stands for a file, as in `mplicits view spot`."""

import os
from difflib import get_close_matches
from pathlib import Path

from .errors import UserError
from .files import show

FOLDER = Path(__file__).parent / "gallery"
"""Folder of the models; each file is named after its model."""
SUFFIX = ".safetensors"
PART = ".part"
"""End of the name of a training's checkpoint, before its ending."""


def names() -> list[str]:
    """List the names of the models, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*" + SUFFIX))


def model_help() -> str:
    """Return the help text of an argument that `model_path` parses."""
    return f"model file (.safetensors), or a name of the gallery: {', '.join(names())}"


def model_path(text: str) -> Path:
    """Return the file of a model that the user names.

    An existing file comes first, then a model of the gallery, then the path itself. So the gallery never hides a file
    of the user, a folder "spot" hides no model, and "./spot" is always a path. Raises UserError if neither exists and
    the gallery has a similar name.
    """
    path = Path(text)
    if os.path.isfile(path) or "/" in text:
        return path
    if text in names():
        return FOLDER / (text + SUFFIX)
    near = [] if path.suffix or os.path.exists(path) else get_close_matches(text, names(), n=1)
    if near:
        raise UserError(f"{show(text)}: no such file; did you mean {near[0]!r}, of the gallery?")
    return path
