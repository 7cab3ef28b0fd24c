"""Whether a value that a Python program gives has the type of an option, and the name of that type for messages."""

import os
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, get_args, get_origin

WORDS = {
    int: "a whole number",
    float: "a number",
    str: "a text",
    Path: "a path",
    bool: "True or False",
    tuple: "a tuple of numbers",
    Sequence: "a list",
    list: "a list",
    Mapping: "a dict",
    Callable: "a function",
}
"""Type, or origin of a generic type -> its name."""


TESTS: dict[Any, Callable[[Any], bool]] = {
    int: lambda value: isinstance(value, Integral) and not isinstance(value, bool),
    float: lambda value: isinstance(value, Real) and not isinstance(value, bool),
    Path: lambda value: isinstance(value, os.PathLike),
    Callable: callable,
}
"""Type, or origin of a generic type, that is more than a class -> whether a value has it."""


def fits(value: object, kind: Any) -> bool:
    """Whether a value has the type of an annotation. Whole numbers are numbers, lists are tuples, and texts no lists.

    True for annotations that are texts: they name what is not imported.
    """
    origin, members = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return any(fits(value, member) for member in members)
    if origin in (tuple, list, Sequence):
        if not isinstance(value, Sequence) or isinstance(value, (str, bytes)):
            return False
        kinds = members if origin is tuple and ... not in members else members[:1] * len(value)
        return len(value) == len(kinds) and all(map(fits, value, kinds))
    if test := TESTS.get(origin or kind):
        return test(value)
    return isinstance(kind, str) or isinstance(value, origin or kind)


def as_tuples(value: Any) -> Any:
    """Return a list, and the lists in it, as tuples; other values as they are."""
    return tuple(map(as_tuples, value)) if isinstance(value, list) else value


def words_of(kind: Any) -> str:
    """Name the types of an annotation: "a whole number or a text"."""
    members = [each for each in get_args(kind) if each is not NoneType] if get_origin(kind) is UnionType else [kind]
    names = [WORDS.get(get_origin(member) or member, getattr(member, "__name__", str(member))) for member in members]
    return " or ".join(dict.fromkeys(names))
