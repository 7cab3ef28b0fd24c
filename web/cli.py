"""The verb `studio`."""

import sys
from dataclasses import dataclass
from pathlib import Path

from ..model.options import Options, option
from ..model.verb import Verb, force_option


@dataclass(frozen=True)
class StudioCommand(Options):
    """Command line of `studio`."""

    output: Path = option(Path("studio.html"), "page to write", metavar="FILE.html", flags=("-o", "--output"))
    force: bool = force_option()


def _studio(command: StudioCommand) -> None:
    """Write the page that trains. Raises UserError."""
    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import GENERATED
    from .studio_page import studio

    check_writable(command.output, kind=GENERATED, force=command.force)
    text = studio()
    write_whole(command.output, text)
    print(
        f"{show(command.output)}: {len(text.encode()):,} bytes; open it in a browser, and drop a mesh", file=sys.stderr
    )


VERBS = (
    Verb(
        "studio",
        "write a web page that trains a model of a dropped mesh",
        StudioCommand,
        "studio -o studio.html",
        _studio,
    ),
)
