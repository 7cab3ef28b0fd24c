"""The options of a verb: a frozen dataclass, from which the command line, the Python function and the checks follow.

    @dataclass(frozen=True)
    class MeshOptions(Options):
        resolution: int = option(512, "cells along each side of the grid", metavar="N", least=8)
        no_cull: bool = option(False, "keep components outside the bands")
        space: str = option("input", "coordinates of the vertices", choices=("input", "model"))

    MeshOptions(resolution=0)         # raises UserError: --resolution 0: a whole number from 8 is needed
    Verb("mesh", ..., MeshOptions)    # declares --resolution N, --no-cull and --space {input,model} (verb.py)
    @takes(MeshOptions)               # gives a function the keywords resolution=512, no_cull=False, space="input"

A subclass adds the options that only the command line has (positional arguments, -o), or the parameters that only the
Python function has (plain fields).
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from functools import wraps
from inspect import getdoc, signature
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, cast, overload

from .errors import UserError
from .extras import advice
from .files import show, show_value
from .value_types import as_tuples, fits, words_of

Value = TypeVar("Value")
GROUPS = ("", "shape", "network", "training", "files")
"""Titles of the parts of `--help`, in their order."""
LARGEST = 1e300
"""Bound of all numbers, below infinity."""


@dataclass(frozen=True)
class Declaration:
    """The metadata of an option. Its field has the name, the type and the default."""

    help: str
    """For `--help` and for the docstring of the Python function."""
    metavar: str | None = None
    """Placeholder of the value in `--help`."""
    choices: Sequence[str] = ()
    old: Mapping[str, str] | None = None
    """Earlier name of a choice -> its name; earlier names work, with a note."""
    least: float | None = None
    """Smallest number, or smallest number of a tuple."""
    above: float | None = None
    """Exclusive lower bound."""
    most: float | None = None
    excludes: str | None = None
    """Name of another option; a user may set only one of the two."""
    parse: Callable[[str], object] | None = None
    """Reads the option's text, where the type of the field does not suffice. The user sees its UserErrors unchanged."""
    flags: Sequence[str] = ()
    """Flags other than --NAME."""
    positional: bool = False
    group: str = ""
    """One of GROUPS."""
    study: bool = False
    """Whether only `--help-all` lists it."""


def option(default: Value, help: str, **more: Any) -> Value:
    """Declare an option by a field's default; more: other fields of `Declaration`."""
    declared: Any = field(default=default, metadata={"declaration": Declaration(help, **more)})
    return cast(Value, declared)


def argument(metavar: str, help: str, parse: Callable[[str], object] | None = None, default: object = MISSING) -> Any:
    """Declare a positional argument: optional where it has a default, one or more where the field is a list."""
    declared = Declaration(help, metavar, parse=parse, positional=True)
    return field(default=default, kw_only=default is MISSING, metadata={"declaration": declared})


@dataclass(frozen=True)
class Options:
    """Base class of all schemas. Raises UserError where a value does not fit its declaration."""

    def __post_init__(self) -> None:
        for each in fields(self):
            self._take(each.name, each.type)
        for name, declared in declarations(type(self)).items():
            value, flag = getattr(self, name), flag_of(name)
            if declared.old and value in declared.old:
                print(f"mplicits: note: {flag} {value} is now {flag} {declared.old[value]}", file=sys.stderr)
                value = declared.old[value]
                object.__setattr__(self, name, value)
            if declared.choices and value is not None and value not in declared.choices:
                raise UserError(f"{flag} {show(str(value))[:60]}: choose from {', '.join(declared.choices)}")
            for number in value if isinstance(value, (tuple, list)) else (value,):
                if isinstance(number, (int, float)) and not isinstance(number, bool):
                    _check_number(flag, number, declared)
            if declared.excludes and self.changed(name) and self.changed(declared.excludes):
                raise UserError(f"{flag}: not allowed with {flag_of(declared.excludes)}")

    def _take(self, name: str, kind: Any) -> None:
        """Check the type of a value, and make plain numbers and tuples of NumPy's, and of lists. Raises UserError."""
        value = getattr(self, name)
        if hasattr(value, "tolist"):
            value = value.tolist()
        if not fits(value, kind):
            raise UserError(f"{flag_of(name)} {show_value(value)}: {words_of(kind)} is needed")
        object.__setattr__(self, name, as_tuples(value) if "tuple[" in str(kind) else value)

    def changed(self, *names: str) -> str:
        """Return the flags of the named options that differ from their defaults: "--fps, --once", or ""."""
        defaults = type(self).__dataclass_fields__
        return ", ".join(flag_of(name) for name in names if getattr(self, name) != defaults[name].default)


def declarations(schema: type[Options]) -> dict[str, Declaration]:
    """Return the declarations of a schema by the names of the fields; plain fields have none."""
    return {each.name: each.metadata["declaration"] for each in fields(schema) if each.metadata}


def flag_of(name: str) -> str:
    """Return the flag of a field's name: no_cull -> --no-cull."""
    return "--" + name.replace("_", "-")


def _check_number(flag: str, number: float, declared: Declaration) -> None:
    """Raise UserError where a number is not finite or out of bounds."""
    least, above, most = declared.least, declared.above, declared.most
    if not (
        abs(number) < LARGEST
        and (least is None or number >= least)
        and (above is None or number > above)
        and (most is None or number <= most)
    ):
        kind = "a whole number" if isinstance(number, int) else "a finite number" if least is most else "a number"
        low = f" from {least:,}" if least is not None else f" above {above:,}" if above is not None else ""
        high = "" if most is None else f" to {most:,}" if least is not None else f", at most {most:,}"
        raise UserError(f"{flag} {number if abs(number) >= LARGEST else f'{number:g}'}: {kind}{low}{high} is needed")


Keywords = ParamSpec("Keywords")
Schema_co = TypeVar("Schema_co", covariant=True)
Result = TypeVar("Result")
A = TypeVar("A")
B = TypeVar("B")


class Takes(Protocol[Keywords, Schema_co]):
    """What `takes` returns: a function (leading arguments, options) becomes one of leading arguments and keywords."""

    @overload
    def __call__(self, function: Callable[[Schema_co], Result], /) -> Callable[Keywords, Result]: ...
    @overload
    def __call__(self, function: Callable[[A, Schema_co], Result], /) -> Callable[Concatenate[A, Keywords], Result]: ...
    @overload
    def __call__(
        self, function: Callable[[A, B, Schema_co], Result], /
    ) -> Callable[Concatenate[A, B, Keywords], Result]: ...


def takes(schema: Callable[Keywords, Schema_co]) -> Takes[Keywords, Schema_co]:
    """Give a function the fields of a schema as keywords, in place of its last parameter, which receives the schema.

    Type checkers, editors, `inspect.signature` and `help` see all of them. Where a package is missing, the function
    raises ModuleNotFoundError with a line that says how to install it.
    """

    def decorate(function: Callable[..., Result]) -> Callable[..., Result]:
        own = signature(function)
        *leading, _ = own.parameters.values()
        full = own.replace(parameters=[*leading, *signature(schema).parameters.values()])

        @wraps(function)
        def call(*args: object, **keywords: object) -> Result:
            values = full.bind(*args, **keywords).arguments
            first = [values.pop(each.name) for each in leading]
            try:
                return function(*first, cast(Any, schema)(**values))
            except ModuleNotFoundError as error:
                if line := advice(error):
                    raise ModuleNotFoundError(line, name=error.name) from None
                raise

        call.__signature__ = full  # type: ignore[attr-defined]
        lines = [f"    {name}: {declared.help}" for name, declared in declarations(cast(Any, schema)).items()]
        call.__doc__ = "\n".join([getdoc(function) or "", "", "Options:", *lines])
        return call

    return cast(Takes[Keywords, Schema_co], decorate)
