"""Output files that appear whole or not at all, and paths and texts that are safe to print."""

import contextlib
import errno
import os
import stat
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from .errors import UserError
from .kinds import Kind, is_other

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

TEMPORARY = ".mplicits-"
"""Prefix of the names of temporary files, which are renamed when they are complete."""
FRESH = 10.0
"""Age in seconds below which a temporary file is kept: its process may be about to lock it."""

READER = 5.0
"""Seconds that the reader of a pipe has to come."""
NO_PROMISE = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)
"""Error numbers of file systems that do not support fsync."""


_named: dict[Path, None] | None = None  # what a command reads; None outside of commands


@contextlib.contextmanager
def inputs_kept() -> Iterator[dict[Path, None]]:
    """Let nothing overwrite the files that `note_input` names meanwhile. Yields their absolute paths."""
    global _named  # noqa: PLW0603 (one command runs at a time)
    _named = {}
    try:
        yield _named
    finally:
        _named = None


def note_input(path: Path) -> None:
    """Note a file that is read because another file or an option names it."""
    if _named is not None:
        _named[path.absolute()] = None


def is_folder(path: Path) -> bool:
    """Whether a path is a folder; False if the system refuses the path, for example because it is too long."""
    with contextlib.suppress(OSError):
        return path.is_dir()
    return False


def is_file(path: Path) -> bool:
    """Whether a path is a file; False if the system refuses the path."""
    with contextlib.suppress(OSError):
        return path.is_file()
    return False


def show_value(value: object) -> str:
    """Return an argument of Python for a message: the first 60 characters of its repr(), in one line."""
    return show(repr(value))[:60]


def path_of(value: object, name: str) -> Path:
    """Return the path that an argument of Python names. name: of the argument, for the UserError."""
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if isinstance(text, str) and "\0" not in text:
        with contextlib.suppress(UnicodeEncodeError):  # half of a surrogate pair
            os.fsencode(text)
            return Path(text)
    raise UserError(f"{name} {show_value(value)}: a path is needed")


def reason_of(error: Exception, otherwise: str) -> str:
    """Say why a file cannot be read: it is missing, or not the user's; `otherwise` for other errors."""
    reasons: dict[type[Exception], str] = {FileNotFoundError: "no such file", PermissionError: "permission denied"}
    return reasons.get(type(error), otherwise)


def regular(path: Path) -> Path:
    """Return a path that is opened for reading next. Raises OSError for a pipe or a device, which may never end."""
    mode = os.stat(path).st_mode
    if stat.S_ISFIFO(mode) or stat.S_ISCHR(mode):
        raise OSError(errno.EINVAL, "a pipe or a device, not a file")
    return path


@contextlib.contextmanager
def silent_library() -> Iterator[None]:
    """Discard what a library in C prints on stderr meanwhile: its error also arrives as an exception."""
    before, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(before, 2)
        os.close(before)
        os.close(nowhere)


def show(text: str | os.PathLike[str]) -> str:
    """Escape the unprintable characters of a path or a text, for a one-line message."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


def check_writable(
    path: Path, reads: Iterable[Path] = (), *, kind: Kind | None = None, force: bool | None = False
) -> None:
    """Check, before long work, that `write_whole` can write a path without a loss for the user.

    reads: input files, which are never overwritten, like those of `note_input`. kind: of the output; only `force`
    overwrites a file of another kind; None: nothing does, because the user did not choose the name. Raises UserError.
    """
    try:
        if path.exists() and any(other.exists() and path.samefile(other) for other in (*reads, *(_named or ()))):
            raise UserError(f"cannot write {show(path)}: it is the input; name another file with -o")
        target = path if is_special(path) else Path(os.path.realpath(path))
        if target.is_dir():
            raise UserError(f"cannot write {show(path)}: it is a folder; name a file")
        if not target.parent.is_dir():
            raise UserError(f"cannot write {show(path)}: the folder {show(target.parent)} does not exist")
        if not os.access(target if target.exists() else target.parent, os.W_OK):
            raise UserError(f"cannot write {show(path)}: permission denied; name a place you may write to")
        if kind is not None and not force and is_other(target, kind):
            raise UserError(
                f"cannot write {show(path)}: it exists and is not {kind.name}; "
                + ("move it away" if force is None else "name another with -o, or add --force")
            )
    except OSError as error:
        raise _refusal(path, error) from None


def write_whole(path: Path, data: bytes | str) -> None:
    """Write a temporary file beside `path`, and rename it: readers see the old file or the new one, never half a file.

    The data is on the disk on return, if the file system supports fsync. data: bytes, or a text, written as UTF-8.
    A link stays a link; devices and pipes (/dev/stdout) are written directly. Raises UserError if the path is not
    writable (no folder, no permission, disk full), and BrokenPipeError if the reader of a pipe leaves.
    """
    check_writable(path)
    # A file name may hold bytes that are no Unicode; they must not end the work here.
    content = data.encode(errors="backslashreplace") if isinstance(data, str) else data
    target = Path(os.path.realpath(path))
    temporary = None
    try:
        if is_special(path):
            with open_special(path) as file:
                file.write(content)
            return
        _sweep(target.parent)
        descriptor, temporary = tempfile.mkstemp(prefix=TEMPORARY, dir=target.parent)
        with os.fdopen(descriptor, "wb") as file:
            _lock(file, wait=True)
            file.write(content)
            file.flush()
            _force(file.fileno())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, target)
        _force_folder(target.parent)
    except BrokenPipeError:  # no error of the path
        raise
    except OSError as error:
        raise _refusal(path, error) from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


def open_special(path: Path) -> BinaryIO:
    """Open a device or a pipe for writing; a pipe needs a reader within `READER` seconds. Raises OSError."""
    if not stat.S_ISFIFO(os.stat(path).st_mode):
        return path.open("wb")
    ends = time.monotonic() + READER
    while True:
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        except OSError as error:
            if error.errno != errno.ENXIO:
                raise
            if time.monotonic() > ends:
                raise OSError(errno.ENXIO, "nobody reads this pipe") from None
            time.sleep(0.05)
        else:
            os.set_blocking(descriptor, True)
            return os.fdopen(descriptor, "wb")


def _lock(file: BinaryIO, *, wait: bool) -> None:
    """Lock a temporary file. Raises OSError if another process holds the lock and `wait` is false.

    Windows needs no lock: the system refuses to remove an open file.
    """
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)


def _force(descriptor: int) -> None:
    """Wait until an open file is on the disk. Raises OSError."""
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in NO_PROMISE:
            raise


def _force_folder(folder: Path) -> None:
    """Wait until the new file name is on the disk. The file itself is complete, so errors do not matter."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _sweep(folder: Path) -> None:
    """Remove the temporary files of killed processes: no process locks them."""
    for path in folder.glob(f"{TEMPORARY}*"):
        try:
            with path.open("rb") as file:
                _lock(file, wait=False)
                old = time.time() - path.stat().st_mtime > FRESH
            if old:
                path.unlink()
        except OSError:
            continue  # Another process writes it, or we may not remove it.


def is_special(path: Path) -> bool:
    """Whether a path is a device, a pipe or a socket."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _refusal(path: Path, error: OSError) -> UserError:
    """Describe in one line why the operating system refuses a path."""
    return UserError(f"cannot write {show(path)}: {error.strerror or error}")
