"""The gallery: models that come with the package and are called by name, as in `mplicits view spot`."""

from pathlib import Path

FOLDER = Path(__file__).parent / "gallery"
"""Where the models are; each file has its model's name."""
SUFFIX = ".safetensors"
FRONTS = {"spot": (215.0, 15.0), "bob": (235.0, 15.0)}
"""Shape -> azimuth and elevation, in degrees, of a camera that sees its face.

A model's name up to the first dash is the name of its shape: "spot-large" shows Spot.
"""


def names() -> list[str]:
    """List the names of all models of the gallery, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*" + SUFFIX))


def model_path(text: str) -> Path:
    """Return the file that a model on the command line means.

    It is the file of that path where there is one, else the gallery's model of that name, else the path as it is. So no
    file of the user's is ever hidden, a folder named "spot" hides no model, and "./spot" is always the user's.
    """
    path = Path(text)
    if path.is_file() or "/" in text or text not in names():
        return path
    return FOLDER / (text + SUFFIX)


def front(path: Path) -> tuple[float, float] | None:
    """Return the azimuth and elevation, in degrees, to look from at a file of the gallery; None for other files."""
    return FRONTS.get(path.stem.partition("-")[0]) if path.parent == FOLDER else None
