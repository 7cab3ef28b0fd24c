"""The gallery: models that come with the package and are called by name, as in `mplicits view spot`."""

import os
from difflib import get_close_matches
from pathlib import Path

from .errors import UserError
from .files import show

FOLDER = Path(__file__).parent / "gallery"
"""Where the models are; each file has its model's name."""
SUFFIX = ".safetensors"


def names() -> list[str]:
    """List the names of all models of the gallery, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*" + SUFFIX))


def model_help() -> str:
    """Return the help for an argument that is read by `model_path`."""
    return f"model file (.safetensors), or a name of the gallery: {', '.join(names())}"


def model_path(text: str) -> Path:
    """Return the file that a model on the command line means.

    It is the file of that path where there is one, else the gallery's model of that name, else the path as it is. So no
    file of the user's is ever hidden, a folder named "spot" hides no model, and "./spot" is always the user's. Raises
    UserError where there is nothing of that name, but something of the gallery has nearly the same.
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
