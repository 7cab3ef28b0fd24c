"""The verb `gallery`."""

from dataclasses import dataclass
from pathlib import Path

from ..model.options import Options, argument, option
from ..model.verb import Verb, force_option


@dataclass(frozen=True)
class GalleryCommand(Options):
    """Command line of `gallery`."""

    folder: Path = argument("DIR", "folder of the site; it is made if it does not exist", Path)
    models: Path | None = option(None, "folder of models (default: those that come with mplicits)", metavar="FOLDER")
    title: str = option("Neural shapes", "title of the index", metavar="TEXT")
    force: bool = force_option()


def _gallery(command: GalleryCommand) -> None:
    """Write the site. Raises UserError."""
    from .write import write_site

    write_site(command.folder, command.models, command.title, command.force)


VERBS = (
    Verb(
        "gallery",
        "write a static web site: an index with pictures, a page for each model, downloads",
        GalleryCommand,
        "gallery site",
        _gallery,
    ),
)
