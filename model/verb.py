"""What a room's cli.py declares: the verbs of the command line that the room knows how to do."""

import re
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Verb:
    """One verb, `mplicits NAME`. The front door (cli.py) collects the verbs of all rooms."""

    name: str
    """What the user types."""
    help: str
    """The line about it in `mplicits --help`."""
    arguments: Callable[[ArgumentParser], None]
    """Adds its arguments to a parser. It is called for every verb at each start, so it imports nothing heavy."""
    example: str
    """A command line that does something with it, without the program's name."""
    run: Callable[[Namespace], None]
    """Does the work, and imports what it needs only then. Raises UserError for what the user can mend."""
    extra: str = "train"
    """The extra of pyproject.toml that a message proposes where a package is missing that the extra brings."""


def take_negative_numbers(parser: ArgumentParser) -> None:
    """Let an option take a value such as -30,20, which is no option itself: Python 3.14's rule, for older versions.

    So may it take the axes -x, -y and -z.
    """
    parser._negative_number_matcher = re.compile(r"-\.?\d|-[xyz]$")


def output_arguments(parser: ArgumentParser, metavar: str, text: str) -> None:
    """Add the options of a verb's output file: -o and --force, which `check_writable` takes. text: the help of -o."""
    parser.add_argument("-o", "--output", type=Path, metavar=metavar, help=text)
    parser.add_argument("--force", action="store_true", help="write over a file of another kind, too")
