"""The verb `gallery`."""

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from ..model.errors import UserError
from ..model.files import show
from ..model.options import Options, argument, option
from ..model.verb import Verb, force_option


def _address(text: str) -> str:
    """Return the address of a folder on the web, which ends with a slash. Raises UserError."""
    parts = urlsplit(text)
    if parts.scheme not in ("http", "https") or not parts.netloc or parts.query or parts.fragment:
        raise UserError(f"--url {show(text)}: an address such as https://example.org/shapes/ is needed")
    return text if text.endswith("/") else text + "/"


@dataclass(frozen=True)
class GalleryCommand(Options):
    """Command line of `gallery`."""

    folder: Path = argument("DIR", "folder of the site; it is made if it does not exist", Path)
    models: Path | None = option(None, "folder of models (default: those that come with mplicits)", metavar="FOLDER")
    title: str = option("Neural shapes", "title of the index", metavar="TEXT")
    url: str | None = option(
        None, "address of the site, for pictures beside links to it", metavar="URL", parse=_address
    )
    force: bool = force_option()


def _gallery(command: GalleryCommand) -> None:
    """Write the site. Raises UserError."""
    from .write import write_site

    write_site(command.folder, command.models, command.title, command.force, command.url or "")


VERBS = (
    Verb(
        "gallery",
        "write a static web site: an index with pictures, a page for each model, downloads",
        GalleryCommand,
        "gallery site",
        _gallery,
    ),
)
