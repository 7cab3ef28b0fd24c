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


def load_numbered(name: str) -> tuple[str, tuple[str, ...]]:
    """The same with `#line` directives, so that a compiler's log names source k and its line; the names of 1, 2, ..."""
    seen: list[str] = []
    return _load(name, seen, numbered=True), tuple(seen)


def _load(name: str, seen: list[str], *, numbered: bool) -> str:
    if name in seen:
        return ""
    seen.append(name)
    source, text = len(seen), read(name)

    def include(match: re.Match[str]) -> str:
        after = f"#line {text.count(chr(10), 0, match.end()) + 1} {source}\n" if numbered else ""
        return _load(match[1], seen, numbered=numbered) + after

    return (f"#line 1 {source}\n" if numbered else "") + _INCLUDE.sub(include, text)
