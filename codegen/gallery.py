"""The models that come with the package, by name: `mplicits view spot`."""

from pathlib import Path

FOLDER = "models"
SUFFIX = ".safetensors"


def names() -> list[str]:
    """Of all models of the gallery, sorted."""
    return sorted(path.stem for path in _folder().glob("*" + SUFFIX))


def model_path(text: str) -> Path:
    """The file that a command line's M means: a file that exists, else the gallery's model of that name, else the path.

    So a file of one's own is never hidden, a folder (the mesh's, say) hides no model, and ./spot is always one's own.
    """
    path = Path(text)
    if path.is_file() or "/" in text or text not in names():
        return path
    return _folder() / (text + SUFFIX)


def _folder() -> Path:
    from importlib.resources import files

    return Path(str(files(FOLDER)))
