"""The models that come with the package, by name: `mplicits view spot`."""

from pathlib import Path

FOLDER = Path(__file__).parent / "gallery"
SUFFIX = ".safetensors"
FRONTS = {"spot": (215.0, 15.0), "bob": (235.0, 15.0)}
"""Azimuth and elevation, degrees, from which a shape shows its face, by its models' names up to the first dash."""


def names() -> list[str]:
    """Of all models of the gallery, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*" + SUFFIX))


def model_path(text: str) -> Path:
    """The file that a command line's M means: a file that exists, else the gallery's model of that name, else the path.

    So a file of one's own is never hidden, a folder (the mesh's, say) hides no model, and ./spot is always one's own.
    """
    path = Path(text)
    if path.is_file() or "/" in text or text not in names():
        return path
    return FOLDER / (text + SUFFIX)


def front(path: Path) -> tuple[float, float] | None:
    """Azimuth and elevation to look from at a model that `model_path` found by its name; None for other files."""
    return FRONTS.get(path.stem.partition("-")[0]) if path.parent == FOLDER else None
