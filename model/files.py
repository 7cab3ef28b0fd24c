"""Output files that appear whole or not at all."""

import os
import tempfile
from pathlib import Path

from .errors import UserError


def show(text: str | os.PathLike[str]) -> str:
    """A path, or text from a file, as it may stand in a one-line message: what does not print is escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


def check_writable(path: Path) -> None:
    """Refuses early, before long work, a path that `write_whole` could not write."""
    try:
        target = path if _is_special(path) else Path(os.path.realpath(path))
        if target.is_dir():
            raise UserError(f"cannot write {show(path)}: it is a folder; name a file")
        if not target.parent.is_dir():
            raise UserError(f"cannot write {show(path)}: the folder {show(target.parent)} does not exist")
        if not os.access(target if target.exists() else target.parent, os.W_OK):
            raise UserError(f"cannot write {show(path)}: permission denied; name a place you may write to")
    except OSError as error:
        raise _refusal(path, error) from None


def write_whole(path: Path, data: bytes | str) -> None:
    """Writes `data` (text as UTF-8) beside `path` first and renames, so that readers never see half a file.

    A link stays a link; a device or a pipe (/dev/stdout) is written to as it is.
    Raises UserError where the path cannot be written (no folder, no permission, disk full).
    """
    check_writable(path)
    # A name that is not Unicode can reach a text through a file name: it must not end the work here.
    content = data.encode(errors="backslashreplace") if isinstance(data, str) else data
    target = Path(os.path.realpath(path))
    temporary = None
    try:
        if _is_special(path):
            path.write_bytes(content)
            return
        descriptor, temporary = tempfile.mkstemp(prefix=".mplicits-", dir=target.parent)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, target)
    except OSError as error:
        raise _refusal(path, error) from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def _is_special(path: Path) -> bool:
    return path.exists() and not path.is_file() and not path.is_dir()


def _refusal(path: Path, error: OSError) -> UserError:
    return UserError(f"cannot write {show(path)}: {error.strerror or error}")
