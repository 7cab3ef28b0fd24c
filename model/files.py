"""Output files that appear whole or not at all, and paths and texts as they may stand in a message."""

import contextlib
import errno
import fcntl
import os
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

from .errors import UserError
from .kinds import Kind, is_other

TEMPORARY = ".mplicits-"
"""How the names of files begin that are being written."""
FRESH = 10.0
"""Seconds for which such a file is not taken for one that was left: its process may be about to lock it."""

NO_PROMISE = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)
"""What file systems say that cannot promise that something is on the disk."""


def is_folder(path: Path) -> bool:
    """Whether a path is that of a folder; false for one that the system refuses, as where a name is too long."""
    with contextlib.suppress(OSError):
        return path.is_dir()
    return False


def is_file(path: Path) -> bool:
    """Whether a path is that of a file; false for one that the system refuses."""
    with contextlib.suppress(OSError):
        return path.is_file()
    return False


def show(text: str | os.PathLike[str]) -> str:
    """Escape what does not print in a path, or in a text from a file, so that it may stand in a one-line message."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


def check_writable(path: Path, reads: Iterable[Path] = (), *, kind: Kind | None = None, force: bool = False) -> None:
    """Check before long work that `write_whole` can write a path, and that nothing is lost by it.

    reads: the files that the work reads; none of them is written over. kind: what will be written; a file of another
    kind is written over only by `force`. Raises UserError where the path cannot, or must not, be written.
    """
    try:
        if path.exists() and any(other.exists() and path.samefile(other) for other in reads):
            raise UserError(f"cannot write {show(path)}: it is what is read; name another file with -o")
        target = path if is_special(path) else Path(os.path.realpath(path))
        if target.is_dir():
            raise UserError(f"cannot write {show(path)}: it is a folder; name a file")
        if not target.parent.is_dir():
            raise UserError(f"cannot write {show(path)}: the folder {show(target.parent)} does not exist")
        if not os.access(target if target.exists() else target.parent, os.W_OK):
            raise UserError(f"cannot write {show(path)}: permission denied; name a place you may write to")
        if kind is not None and not force and is_other(target, kind):
            raise UserError(
                f"cannot write {show(path)}: it is there and not {kind.name}; name another file with -o, or add --force"
            )
    except OSError as error:
        raise _refusal(path, error) from None


def write_whole(path: Path, data: bytes | str) -> None:
    """Write a file so that readers never see half of it: beside `path` first, then renamed.

    It is on the disk when this returns, where the file system can promise that, and a power cut finds the old file or
    the new one. data: bytes, or a text that is written as UTF-8. A link stays a link; a device or a pipe (/dev/stdout)
    is written to as it is. Raises UserError where the path cannot be written (no folder, no permission, disk full), and
    BrokenPipeError where nobody reads a pipe to its end.
    """
    check_writable(path)
    # Characters that are not Unicode can reach a text through a file name. They must not end the work here.
    content = data.encode(errors="backslashreplace") if isinstance(data, str) else data
    target = Path(os.path.realpath(path))
    temporary = None
    try:
        if is_special(path):
            path.write_bytes(content)
            return
        _sweep(target.parent)
        descriptor, temporary = tempfile.mkstemp(prefix=TEMPORARY, dir=target.parent)
        with os.fdopen(descriptor, "wb") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            file.write(content)
            file.flush()
            _force(file.fileno())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, target)
        _force_folder(target.parent)
    except BrokenPipeError:  # The reader of a pipe left, which is no error.
        raise
    except OSError as error:
        raise _refusal(path, error) from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def _force(descriptor: int) -> None:
    """Wait until an open file is on the disk. Raises OSError where the disk does not take it."""
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in NO_PROMISE:
            raise


def _force_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk: the file is written, so whatever fails here is no failure."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _sweep(folder: Path) -> None:
    """Remove files that killed processes have left half written in a folder: nobody locks them any longer."""
    for path in folder.glob(f"{TEMPORARY}*"):
        try:
            with path.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if time.time() - path.stat().st_mtime > FRESH:
                    path.unlink()
        except OSError:
            continue  # Another process writes it, or it is not ours to remove.


def is_special(path: Path) -> bool:
    """Whether a path is there and is neither a file nor a folder: a device, a pipe, a socket."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _refusal(path: Path, error: OSError) -> UserError:
    """Make the one line for a path that the operating system refuses."""
    return UserError(f"cannot write {show(path)}: {error.strerror or error}")
