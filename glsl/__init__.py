"""GLSL written by hand, which every GLSL target shares, and the loader that joins its files."""

import re
from importlib.resources import files

INCLUDE = re.compile(r'^#include "([\w.]+)"\n', re.MULTILINE)
"""A line that the file which it names takes the place of; the name is its one group."""


def read(name: str) -> str:
    """Return the text of the file `name` in this folder."""
    return files(__name__).joinpath(name).read_text(encoding="utf-8")


def load(name: str) -> str:
    """Return the text of the file `name` in this folder with its includes replaced by the files that they name.

    An include is a line `#include "other.glsl"`. A file that is included twice stands where it is first.
    """
    return _load(name, [], numbered=False)


FILE = 1_000_000
"""How far apart the line numbers of two files are in `load_numbered`.

Not every driver's log says which source a line is of, so the line number itself has to.
"""


def load_numbered(name: str) -> tuple[str, tuple[str, ...]]:
    """Return what `load` does, with `#line` directives, and the names of the files that it is made of.

    Line n of the k-th file, both counted from 1, has the number FILE * k + n.
    """
    seen: list[str] = []
    return _load(name, seen, numbered=True), tuple(seen)


def _load(name: str, seen: list[str], *, numbered: bool) -> str:
    """Join a file and what it includes, without the files of `seen`, to which it adds those that it takes."""
    if name in seen:
        return ""
    seen.append(name)
    start, text = FILE * len(seen), read(name)

    def include(match: re.Match[str]) -> str:
        after = f"#line {start + text.count(chr(10), 0, match.end()) + 1}\n" if numbered else ""
        return _load(match[1], seen, numbered=numbered) + after

    return (f"#line {start + 1}\n" if numbered else "") + INCLUDE.sub(include, text)
