"""The verbs of the command line, which each room's cli.py declares, and how argparse reads their options."""

import re
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin

from .options import GROUPS, Declaration, Options, declarations, flag_of, option

HELP_ALL = "--help-all"


@dataclass(frozen=True)
class Verb:
    """One verb, `mplicits NAME`. The front door (cli.py) collects the verbs of all rooms."""

    name: str
    help: str
    """Its line in `mplicits --help`."""
    options: type[Options]
    """Its options and positional arguments. Every start of the program imports them, so their module is light."""
    example: str
    """A command line, without the program's name."""
    work: Callable[[Any], None]
    """Receives an instance of `options`, and imports what it needs. Raises UserError for errors of the user."""
    extra: str = "train"
    """Extra of pyproject.toml that brings the packages of the verb."""

    def arguments(self, parser: ArgumentParser, *, every: bool = False) -> None:
        """Add the verb's options to a parser. every: whether its help lists those for studies, too."""
        add_arguments(parser, self.options, every=every)

    def run(self, args: Namespace) -> None:
        """Run the verb with parsed arguments. Raises UserError."""
        self.work(read(self.options, args))


def output_option(metavar: str, help: str) -> Any:
    """Declare -o, the output file of a verb."""
    return option(None, help, metavar=metavar, flags=("-o", "--output"))


def force_option() -> Any:
    """Declare --force, for `check_writable`."""
    return option(False, "write over a file of another kind, too")


def add_arguments(parser: ArgumentParser, schema: type[Options], *, every: bool = False) -> None:
    """Declare a schema's options to a parser. Options that the user leaves out are absent from the namespace.

    The type of a field decides how its text is read: bool is a flag, a tuple is numbers joined by commas, a type that
    includes str keeps the text. The help ends with the default, unless this is None, False or "". every: see `Verb`.
    """
    groups: dict[str, Any] = {"": parser}
    # A value such as -30,20 or -y is no option: the rule of Python 3.14, for older versions.
    parser._negative_number_matcher = re.compile(r"-\.?\d|-[xyz]$")
    declared_fields = [each for each in fields(schema) if each.metadata]
    for each in sorted(declared_fields, key=lambda each: GROUPS.index(each.metadata["declaration"].group)):
        declared: Declaration = each.metadata["declaration"]
        types = get_args(each.type) if isinstance(each.type, UnionType) else (each.type,)
        more: dict[str, Any] = {"default": SUPPRESS, "help": declared.help.replace("%", "%%")}
        names = [each.name] if declared.positional else declared.flags or [flag_of(each.name)]
        if bool in types:
            more |= {"action": "store_true"}
        else:
            choices = "{" + ",".join(declared.choices) + "}" if declared.choices else None
            reader = _reader(declared, types)
            is_name = declared.positional or Path in types
            more |= {"type": _named(reader) if is_name else reader, "metavar": declared.metavar or choices}
        if declared.positional:
            more["nargs"] = "+" if get_origin(types[0]) is list else None if each.default is MISSING else "?"
            more["default"] = None
        else:
            more["dest"] = each.name
            if each.default not in (None, "") and each.default is not False:
                more["help"] += f" (default: {_text(each.default)})"
        if declared.study and not every:
            more["help"] = SUPPRESS
        title = declared.group
        if title not in groups:
            groups[title] = parser.add_argument_group(title)
        groups[title].add_argument(*names, **more)
    if any(declared.study for declared in declarations(schema).values()):
        parser.add_argument(HELP_ALL, action="help", help="list the options for studies, too")


def read(schema: type[Options], args: Namespace) -> Any:
    """Build an instance of a schema from parsed arguments. Raises UserError."""
    return schema(**{name: value for name, value in vars(args).items() if name in declarations(schema)})


def command_line(options: Options, schema: type[Options]) -> list[str]:
    """Write the options of `schema` that differ from their defaults as arguments: ["--no-cull", "--space=model"]."""
    written = []
    for name in declarations(schema):
        if flag := options.changed(name):
            value = getattr(options, name)
            written.append(flag if value is True else f"{flag}={_text(value)}")
    return written


def _text(value: object) -> str:
    """Write a value as on the command line."""
    if isinstance(value, (tuple, list)):
        return ",".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def _reader(declared: Declaration, types: Sequence[Any]) -> Callable[[str], object]:
    """Choose the function that reads an option's text."""
    tuples = [get_args(kind) for kind in types if get_origin(kind) is tuple]
    if declared.parse is not None:
        return declared.parse
    if str in types:
        return str
    if tuples:
        return _numbers(tuples[0][0], [len(members) for members in tuples if ... not in members])
    kind: type = next(iter(get_args(types[0]) or types))
    return kind


def _named(reader: Callable[[str], object]) -> Callable[[str], object]:
    """Refuse an empty text, as of a variable of the shell that is not set: it is not the current folder."""

    def checked(text: str) -> object:
        if not text:
            raise ArgumentTypeError("an empty name; a path is needed")
        return reader(text)

    return checked


def _numbers(kind: type, counts: Sequence[int]) -> Callable[[str], object]:
    """Return a reader of numbers joined by commas. counts: the allowed numbers of values; empty allows any."""

    def reader(text: str) -> object:
        try:
            numbers = tuple(kind(part) for part in text.split(","))
        except ValueError:
            numbers = ()
        if not numbers or (counts and len(numbers) not in counts):
            words = [" or ".join(map(str, counts)), "whole" if kind is int else "", "numbers joined by commas"]
            raise ArgumentTypeError(f"{text!r}: {' '.join(filter(None, words))} are needed")
        return numbers

    return reader
