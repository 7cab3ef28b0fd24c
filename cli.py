"""The command `mplicits`: collects the verbs of all rooms, and runs one."""

import argparse
import errno
import importlib
import io
import math
import os
import re
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from typing import NoReturn

from .demo import demo_verb
from .model.errors import UserError
from .model.extras import advice, install_and_repeat
from .model.files import inputs_kept, show
from .model.interrupts import ENDINGS, INTERRUPTED, ended_by
from .model.verb import HELP_ALL, Verb
from .model.version import installed_version

ROOMS = ("api", "trainer", "capture", "scenes", "web", "bake", "viewer", "mesher", "reporting", "site")
"""Folders whose cli.py declares VERBS, in the order of the help."""
ABOUT = "A mesh or an oriented point cloud becomes a small multiscale neural SDF, baked into shaders."
EXAMPLE = "example: mplicits train bunny.ply -o bunny.safetensors"

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Error numbers of a full disk or output."""
NO_MEMORY = re.compile("allocate memory|out of memory")
"""Messages of PyTorch where the processor's or the GPU's memory does not suffice."""
CLOSED = (errno.EACCES, errno.EPERM, errno.ENAMETOOLONG, errno.ELOOP, errno.EMFILE, errno.ENFILE, errno.EROFS)
"""Error numbers of paths that the system does not open for this user."""

LEAST_STACK = 1 << 20
"""Bytes of the stack that libraries need: with less, the system ends the process."""


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Raise UserError with argparse's message and a pointer to --help."""
        raise UserError(f"{message} (see {self.prog} --help)")


def verbs() -> dict[str, Verb]:
    """Return the verbs by name, in the order of the help. Imports each room's cli.py, which is light."""
    room_verbs = [verb for room in ROOMS for verb in importlib.import_module(f".{room}.cli", __package__).VERBS]
    return {verb.name: verb for verb in (demo_verb(perform), *room_verbs)}


def perform(argv: Sequence[str]) -> None:
    """Run one command line, without the program's name. Raises UserError, and SystemExit(0) after --help."""
    known = verbs()
    parser = Parser(prog="mplicits", usage="mplicits VERB ...", description=ABOUT, epilog=EXAMPLE)
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    choices = parser.add_subparsers(title="verbs", metavar="VERB", dest="verb", prog="mplicits")
    for verb in known.values():
        verb.arguments(
            choices.add_parser(
                verb.name, help=verb.help, description=verb.help, epilog=f"example: mplicits {verb.example}"
            ),
            every=HELP_ALL in argv,
        )
    if argv and not argv[0].startswith("-") and argv[0] not in known:
        near = get_close_matches(argv[0], known, n=1)
        raise UserError(f"no verb {argv[0]!r}; " + (f"did you mean '{near[0]}'?" if near else "see mplicits --help"))
    args = parser.parse_args(argv)
    if args.version:
        print(f"mplicits {installed_version()}")
    elif args.verb is None:
        parser.print_help()
    else:
        known[args.verb].run(args)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line and return the exit code.

    0: done. 2: an error that the user can fix. 130, 143, 129: ended by Ctrl-C, SIGTERM, SIGHUP. Other exceptions are
    bugs and pass through. argv: the arguments (default: those of sys.argv).
    """
    argv = sys.argv[1:] if argv is None else argv
    _prepare_streams()
    if (stack := stack_limit()) < LEAST_STACK:
        return fail(f"the stack is limited to {stack / 1024:.0f} kB; run: ulimit -s {LEAST_STACK >> 10}", 2)
    try:
        with warnings.catch_warnings():
            if not sys.warnoptions:  # Libraries warn their callers, not the user; python -W shows it.
                warnings.simplefilter("ignore")
            with inputs_kept():
                code = _perform(argv)
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt) as error:
        ending = _ending(error, argv)
        if ending is None:
            raise
        code, line = ending
        if isinstance(error, OSError) and error.filename is None:
            # Nobody can read the rest of the buffer: it must not raise at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if line:
            return fail(line, code)
    return code


def _ending(error: BaseException, argv: Sequence[str]) -> tuple[int, str] | None:
    """Return the exit code and the error line (may be empty) of an exception; None if it is a bug."""
    code, line = 2, None
    match error:
        case UserError():
            line = str(error)
        case ModuleNotFoundError():
            extra = verbs()[argv[0]].extra
            install_and_repeat(error, extra, argv)
            line = advice(error, extra)
        case KeyboardInterrupt():
            by = ended_by()
            code, line = (128 + by, ENDINGS[by]) if by else (INTERRUPTED, "interrupted")
        case MemoryError() | RuntimeError() if isinstance(error, MemoryError) or NO_MEMORY.search(str(error)):
            line = "out of memory: close other programs, or ask for less (a lower resolution, a smaller file)"
        case BrokenPipeError():  # The reader left.
            code, line = 141, ""
        case OSError(errno=number) if number in FULL:
            line = f"cannot write to the standard output: {error.strerror}"
        case OSError(errno=number, filename=str() as name) if number in CLOSED:
            line = f"{name}: {error.strerror}"
    return None if line is None else (code, line)


def _perform(argv: Sequence[str]) -> int:
    """Run one command line. Returns 0, or the exit code of argparse after --help."""
    try:
        perform(argv)
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else 0
    return 0


def stack_limit() -> float:
    """Return the bytes that the stack may take; infinity where the system has no limit."""
    try:
        import resource
    except ImportError:  # Windows
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_STACK)[0]
    return math.inf if limit == resource.RLIM_INFINITY else limit


def _prepare_streams() -> None:
    """Let stdout and stderr take any text, even if the caller has closed them."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 (it stays open)
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):  # File names may have characters that the terminal lacks.
            stream.reconfigure(errors="backslashreplace")


def fail(line: str, code: int) -> int:
    """Print one line on stderr, in place of open progress bars, and return an exit code."""
    bars = sys.modules["tqdm"].tqdm if "tqdm" in sys.modules else None
    with suppress(OSError):  # Nobody may be there to read it.
        for bar in list(getattr(bars, "_instances", ())):
            bar.leave = False
            bar.close()
        print(f"mplicits: {show(line)}", file=sys.stderr)
    return code
