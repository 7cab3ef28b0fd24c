"""Line numbers of keys in TOML: the parser of the standard library reports lines of syntax errors alone."""

import re

Path = tuple[str | int, ...]
"""Keys, and indices of arrays from 0, from the top of the file."""

_HEADER = re.compile(r"\s*(\[\[?)([^\[\]]+)\]")
_KEY = re.compile(r"[\w.\"' -]+")


def line_of(text: str, key: str) -> int:
    """Return the line, counted from 1, of a key such as `parts[2].scale`.

    A key inside brackets or braces has the line of the key before them. An unknown key has line 1.
    """
    wanted: Path = tuple(
        int(part) - 1 if part.isdecimal() else part for part in re.findall(r"[^.\[\]]+", key) if part != "scene"
    )
    counts: dict[Path, int] = {}
    table: Path = ()
    best, line = 0, 1
    for number, row in enumerate(text.splitlines(), start=1):
        if (header := _HEADER.match(row)) is not None:
            table = _inside(header[2], counts)
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
            place = table
        elif _KEY.fullmatch(entry := row.partition("=")[0].strip()) and "=" in row:
            place = (*table, *_names(entry))
        else:
            continue
        if len(place) > best and place == wanted[: len(place)]:
            best, line = len(place), number
    return line


def _inside(dotted: str, counts: dict[Path, int]) -> Path:
    """Return the path of a header's name; an array in the path stands for its last element so far."""
    *before, last = _names(dotted)
    path: Path = ()
    for name in before:
        path = (*path, name)
        path = (*path, counts[path]) if path in counts else path
    return (*path, last)


def _names(dotted: str) -> list[str]:
    return [name.strip(" \"'") for name in dotted.split(".")]
