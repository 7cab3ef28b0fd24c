"""Output files that appear whole or not at all."""

import os
import tempfile
from pathlib import Path

from .errors import UserError


def show(path: str | os.PathLike[str]) -> str:
    """A path as it may stand in a one-line message: control characters escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(path))


def check_writable(path: Path) -> None:
    """Refuses early, before long work, a path that `write_whole` could not write."""
    if path.is_dir():
        raise UserError(f"cannot write {show(path)}: it is a folder; name a file")
    if not path.absolute().parent.is_dir():
        raise UserError(f"cannot write {show(path)}: the folder {show(path.absolute().parent)} does not exist")
    if not os.access(path.absolute().parent, os.W_OK):
        raise UserError(f"cannot write {show(path)}: the folder is not writable")


def write_whole(path: Path, data: bytes | str) -> None:
    """Writes `data` (text as UTF-8) beside `path` first and renames, so that readers never see half a file.

    Raises UserError where the path cannot be written (no folder, no permission, disk full).
    """
    check_writable(path)
    temporary = None
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=".mplicits-", dir=path.absolute().parent)
        with os.fdopen(descriptor, "wb") as file:
            file.write(data.encode() if isinstance(data, str) else data)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except OSError as error:
        raise UserError(f"cannot write {show(path)}: {error.strerror or error}") from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
