"""Hand-written GLSL, one function per file, shared by every GLSL target; and the loader that joins the files."""

import re
from importlib.resources import files

_INCLUDE = re.compile(r'^#include "([\w.]+)"\n', re.MULTILINE)


def read(name: str) -> str:
    """Text of the file `name` in this folder."""
    return files(__name__).joinpath(name).read_text(encoding="utf-8")


def load(name: str) -> str:
    """Text of the file `name` in this folder with each `#include "other.glsl"` replaced, once, by that file."""
    return _load(name, [], numbered=False)


FILE = 1_000_000
"""Line numbers of `load_numbered` go up by this from file to file: not every driver's log names a source's number."""


def load_numbered(name: str) -> tuple[str, tuple[str, ...]]:
    """`load` with `#line` directives: line n of file k, from 1, has the number FILE * k + n; and the files' names."""
    seen: list[str] = []
    return _load(name, seen, numbered=True), tuple(seen)


def _load(name: str, seen: list[str], *, numbered: bool) -> str:
    if name in seen:
        return ""
    seen.append(name)
    start, text = FILE * len(seen), read(name)

    def include(match: re.Match[str]) -> str:
        after = f"#line {start + text.count(chr(10), 0, match.end()) + 1}\n" if numbered else ""
        return _load(match[1], seen, numbered=numbered) + after

    return (f"#line {start + 1}\n" if numbered else "") + _INCLUDE.sub(include, text)
