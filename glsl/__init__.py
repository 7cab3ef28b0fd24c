"""Handwritten GLSL, shared by every GLSL target: passes/, functions/, and the loader that resolves includes."""

import re
from importlib.resources import files

INCLUDE = re.compile(r'^#include "([\w.]+)"\n', re.MULTILINE)
"""An include line; group 1 is the file's name."""
FILE = 1_000_000
"""Distance between the line numbers of two files in `load_numbered`: some drivers report only the line number."""


def read(name: str) -> str:
    """Return the text of a pass, which has main(), or of a function."""
    places = [files(__name__).joinpath(folder, name) for folder in ("passes", "functions")]
    return next((place for place in places if place.is_file()), places[0]).read_text(encoding="utf-8")


def load(name: str) -> str:
    """Return a file with its includes, `#include "other.glsl"`, replaced by their text, each file only once."""
    return _load(name, [], numbered=False)


def load_numbered(name: str) -> tuple[str, tuple[str, ...]]:
    """Return the text of `load` with `#line` directives, and the names of its files.

    Line n of the k-th file, both counted from 1, has the number FILE * k + n.
    """
    seen: list[str] = []
    return _load(name, seen, numbered=True), tuple(seen)


def _load(name: str, seen: list[str], *, numbered: bool) -> str:
    """Load a file and its includes, without those in `seen`, and add their names to `seen`."""
    if name in seen:
        return ""
    seen.append(name)
    start, text = FILE * len(seen), read(name)

    def include(match: re.Match[str]) -> str:
        after = f"#line {start + text.count(chr(10), 0, match.end()) + 1}\n" if numbered else ""
        return _load(match[1], seen, numbered=numbered) + after

    return (f"#line {start + 1}\n" if numbered else "") + INCLUDE.sub(include, text)
