"""Kinds of output files, recognized by their content, because a name may say anything."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

PREFIX_BYTES = 1 << 25
"""Bytes of a file that are read to recognize its kind."""
PREFIX_TEXT = 1 << 16
"""First bytes of a PNG, among which is its `MARK`."""


@dataclass(frozen=True)
class Kind:
    """A kind of file."""

    name: str
    """Name with its article, for messages."""
    holds: Callable[[bytes], bool]
    """Whether the first `PREFIX_BYTES` bytes, at least one, belong to a file of this kind."""


def is_other(path: Path, kind: Kind) -> bool:
    """Whether a path is a file, not empty, of another kind than `kind`. Raises OSError if it is unreadable."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        content = file.read(PREFIX_BYTES)
    return bool(content) and not kind.holds(content)


def _is_model(content: bytes) -> bool:
    header = content[8 : 8 + int.from_bytes(content[:8], "little")]
    return header.startswith(b"{") and re.search(rb'"format"\s*:\s*"mplicits"', header) is not None


def _is_mesh(content: bytes) -> bool:
    """Recognize PLY, GLB and ASCII STL by their first bytes, binary STL by its size, OBJ by its lines of vertices."""
    triangles = int.from_bytes(content[80:84], "little")
    return (
        content.startswith((b"ply\n", b"ply\r", b"glTF", b"solid "))
        or (len(content) >= 84 and len(content) == min(84 + 50 * triangles, PREFIX_BYTES))
        or re.search(rb"^v[ \t]+[-+.\d]", content, re.MULTILINE) is not None
    )


MARK = "mplicits"
"""Comment in pictures, videos and PLY files that mplicits writes: the user's own have none."""
MODEL = Kind("a model", _is_model)
MESH = Kind("a mesh", _is_mesh)
OWN_MESH = Kind("a PLY that mplicits wrote", lambda content: f"\ncomment {MARK}\n".encode() in content[:200])
"""For names that the user did not choose: the user's scan may have that name."""
PICTURE = Kind(
    "a picture that mplicits wrote",
    lambda content: re.search(rb"tEXtSoftware\0mplicits|\xff\xfe\0\nmplicits", content[:PREFIX_TEXT]) is not None,
)
"""A PNG or a JPEG, with MARK as its software or its comment."""
VIDEO = Kind(
    "a video that mplicits wrote",
    lambda content: (content[4:8] == b"ftyp" or content.startswith(b"GIF89a")) and MARK.encode() in content,
)
LOG = Kind("a log of a training", lambda content: content.startswith(b'{"level": '))
REPORT = Kind("a report", lambda content: b'content="mplicits report"' in content)
RESULTS = Kind("a page of models that mplicits wrote", lambda content: b'content="mplicits models"' in content)
TABLE = Kind("a table of models that mplicits wrote", lambda content: content.startswith(b"name,status,shape,seconds,"))
GALLERY = Kind("the index of a gallery", lambda content: b'content="mplicits gallery"' in content)
GENERATED = Kind(
    "a text that mplicits wrote",
    lambda content: re.search(rb'\{"mplicits": "|<!-- (?:A page of |Made with )?mplicits', content) is not None,
)
"""Output of every target of `bake`: its header line (codegen/targets/header.py), or the comment of a packed page."""
