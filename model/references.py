"""Files that other files name: buffers, materials, images, photographs. One rule for all: below one folder.

A hostile file names `../../secret`, `/proc/self/environ` or a link to them, and what it names would become points and
colors that others see.
"""

import os
import re
import stat
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from .errors import UserError
from .files import note_input, show
from .options import option

MISSING = "not found beside the file"
OUTSIDE = "outside of the folder; --follow reads it"
ADDRESS = "an address, which is not read; keep its file beside"
NO_FILE = "a pipe or a device, not a file"
LONGEST = 4096
"""Most characters of a name: no system has longer paths."""
FOLLOW_HELP = "read also what a file names outside of its folder: absolute paths, `..`, links"


def follow_option() -> bool:
    """Declare --follow, for verbs that read files which name others."""
    return option(False, FOLLOW_HELP)


class UnresolvedError(UserError):
    """A reference that is not read: "NAME: why"."""

    def __init__(self, name: str, why: str) -> None:
        shown = show(name[:80]) + "..." * (len(name) > 80)
        super().__init__(f"{shown}: {why}")
        self.name, self.why = shown, why


@dataclass(frozen=True)
class Folder:
    """A folder whose files may name one another."""

    path: Path
    follow: bool = False
    """Whether the user allows names of files elsewhere."""

    def file(self, name: str | Path) -> Path:
        """Return the regular file that a reference names: a path below this folder, also after resolving links.

        Backslashes separate folders, too. Raises UnresolvedError for all else.
        """
        text = str(name)
        if not text or "\0" in text or len(text) > LONGEST:
            raise UnresolvedError(text, MISSING)
        if re.match(r"[a-z][a-z0-9+.-]+://|(file|https?|ftp|data):", text, re.IGNORECASE):
            raise UnresolvedError(text, ADDRESS)
        try:
            path = self.below(text)
            kind = os.stat(path).st_mode
        except (OSError, ValueError):  # missing, too long, or characters that the system does not have
            raise UnresolvedError(text, MISSING) from None
        if stat.S_ISDIR(kind):
            raise UnresolvedError(text, MISSING)
        if not stat.S_ISREG(kind):
            raise UnresolvedError(text, NO_FILE)
        note_input(path)
        return path

    def find(self, name: str | Path) -> Path | None:
        """Return the file that a reference names; None if there is none. Raises UnresolvedError for one elsewhere."""
        try:
            return self.file(name)
        except UnresolvedError as error:
            if error.why == MISSING:
                return None
            raise

    def below(self, name: str) -> Path:
        """Return the path of a name that may not exist. Raises UnresolvedError elsewhere, OSError and ValueError."""
        path = self.path / name.replace("\\", "/")
        # Drives and shares first: to resolve them would already contact a server.
        if not self.follow and re.match(r"[A-Za-z]:[\\/]|[\\/]{2}", name):
            raise UnresolvedError(name, OUTSIDE)
        if not self.follow and os.path.commonpath((self._root, os.path.realpath(path))) != self._root:
            raise UnresolvedError(name, OUTSIDE)
        return path

    @cached_property
    def _root(self) -> str:
        return os.path.realpath(self.path)
