"""Joins JavaScript modules, which lie in the folders of this one, into one script."""

import re
from collections.abc import Iterable
from functools import cache
from importlib.resources import files

_IMPORT = re.compile(r'^import \{[^}]*\} from "(?:[.\w]+/)+([\w.]+)";$', re.MULTILINE)
_CONSTANT = re.compile(r"^export (const (\w+) = .*\n)", re.MULTILINE)
_MODULE_LINE = re.compile(r"^import [^;]*;\n|^export (?=\w)", re.MULTILINE)
"""The imports and exports of a module, which the joined script drops."""

CONSTANTS = "constants.js"
"""The module that constants.py writes."""


def modules(*entries: str) -> tuple[str, ...]:
    """Return the names of modules and of all that they import, each after its own imports."""
    ordered, seen = list[str](), set[str]()

    def add(name: str) -> None:
        if name not in seen:
            seen.add(name)
            for needed in _IMPORT.findall(sources()[name]):
                add(needed)
            ordered.append(name)

    for name in entries:
        add(name)
    return tuple(ordered)


def script(names: Iterable[str], after: Iterable[str] = ()) -> str:
    """Join modules into one script, without imports, exports, and the constants that none of them reads.

    after: modules of a script that stands before this one, in the same scope.
    """
    text, before = _joined(names), set(re.findall(r"\w+", _joined(after)))
    words = set(re.findall(r"\w+", text)) - before
    return "".join(line for line, name in _CONSTANT.findall(sources()[CONSTANTS]) if name in words) + text


def _joined(names: Iterable[str]) -> str:
    return "".join(_MODULE_LINE.sub("", sources()[name]) for name in names if name != CONSTANTS)


def read(path: str) -> str:
    """Return the text of a file, such as "view/page.html"."""
    return files(__package__).joinpath(*path.split("/")).read_text(encoding="utf-8")


@cache
def sources() -> dict[str, str]:
    """Return the text of every module by its name, which is unique."""
    folders = [folder for folder in files(__package__).iterdir() if folder.is_dir()]
    return {
        file.name: file.read_text(encoding="utf-8")
        for folder in folders
        for file in folder.iterdir()
        if file.name.endswith(".js")
    }
