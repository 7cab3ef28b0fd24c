"""The front door: the command `mplicits`, which collects the verbs of the rooms and runs one of them."""

import argparse
import errno
import importlib
import io
import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from typing import NoReturn

from .api.hooks import describe_surface, loose_pieces, pictures, surface_of
from .demo import demo_verb
from .extras import advice, install_and_repeat
from .model.errors import UserError
from .model.files import show
from .model.interrupts import ENDINGS, INTERRUPTED, ended_by
from .model.verb import Verb
from .model.version import installed_version
from .trainer.cli import train_verb
from .trainer.motion_cli import morph_verb

ROOMS = ("trainer", "capture", "scenes", "bake", "viewer", "mesher", "reporting")
"""Folders whose cli.py declares VERBS, in the order of the help."""
ABOUT = "A mesh or an oriented point cloud becomes a small multiscale neural SDF, baked into shaders."
EXAMPLE = "example: mplicits train bunny.ply -o bunny.safetensors"

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""What the operating system says of a disk, or of an output, that takes no more."""


class Parser(argparse.ArgumentParser):
    """An argument parser whose complaints are one line."""

    def error(self, message: str) -> NoReturn:
        """Raise UserError with argparse's message and where to read on."""
        raise UserError(f"{message} (see {self.prog} --help)")


def verbs() -> dict[str, Verb]:
    """Collect the verbs by name, in the order of the help. Imports each room's cli.py; these import nothing heavy."""
    of_rooms = [verb for room in ROOMS for verb in importlib.import_module(f".{room}.cli", __package__).VERBS]
    trainings = train_verb(describe_surface, pictures, loose_pieces), morph_verb(describe_surface, surface_of, pictures)
    return {verb.name: verb for verb in (demo_verb(perform), *trainings, *of_rooms)}


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
            )
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

    It is 0, 2 for what the user can mend, 130 after Ctrl-C, 143 after SIGTERM, or 129 after SIGHUP. argv: the
    arguments, sys.argv's by default. Other exceptions are bugs and pass through.
    """
    argv = sys.argv[1:] if argv is None else argv
    _prepare_streams()
    try:
        with warnings.catch_warnings():
            if not sys.warnoptions:  # Libraries warn their callers, not the user; python -W shows it.
                warnings.simplefilter("ignore")
            code = _perform(argv)
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt) as error:
        ending = _ending(error, argv)
        if ending is None:
            raise
        code, line = ending
        if isinstance(error, OSError):
            # What is still buffered has nowhere to go, and must not complain at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if line:
            return fail(line, code)
    return code


def _ending(error: BaseException, argv: Sequence[str]) -> tuple[int, str] | None:
    """Return the exit code and the line that an exception ends in; the line is empty where nothing is to be said.

    None: the exception is a bug.
    """
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
        case MemoryError():
            line = "out of memory: close other programs, or ask for less (a lower resolution, a smaller file)"
        case BrokenPipeError():  # The reader left.
            code, line = 141, ""
        case OSError(errno=number) if number in FULL:
            line = f"cannot write to the standard output: {error.strerror}"
    return None if line is None else (code, line)


def _perform(argv: Sequence[str]) -> int:
    """Run one command line. Returns the exit code of argparse after --help, 0 otherwise."""
    try:
        perform(argv)
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else 0
    return 0


def _prepare_streams() -> None:
    """Make the output and error streams take any text, also where the caller has closed them."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 (it stays open)
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):  # A file name need not be text that the terminal can show.
            stream.reconfigure(errors="backslashreplace")


def fail(line: str, code: int) -> int:
    """Print one line on stderr and return an exit code."""
    with suppress(OSError):  # Nobody may be there to read it.
        print(f"mplicits: {show(line)}", file=sys.stderr)
    return code
