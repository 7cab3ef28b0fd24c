"""Hand-written GLSL, one function per file, shared by every GLSL target; and the loader that joins the files."""

import re
from importlib.resources import files

_INCLUDE = re.compile(r'^#include "([\w.]+)"\n', re.MULTILINE)


def load(name: str) -> str:
    """Text of the file `name` in this folder with each `#include "other.glsl"` replaced, once, by that file."""
    return _load(name, set())


def _load(name: str, seen: set[str]) -> str:
    if name in seen:
        return ""
    seen.add(name)
    text = files(__name__).joinpath(name).read_text(encoding="utf-8")
    return _INCLUDE.sub(lambda match: _load(match[1], seen), text)
