"""Reads STL files: binary ones by their count of triangles, texts by their vertices."""

import re
from pathlib import Path

import numpy as np

from ..model.errors import UserError
from .content import Mesh

HEADER = 84  # bytes before the triangles of a binary file; the last four are their count
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
UNKNOWN = (0, 0xFFFFFFFF)
"""Counts that programs write which do not know it yet."""
EMPTY = "the mesh is empty; a shape needs triangles or points"


def read_stl(path: Path) -> Mesh:
    """Read an STL file. Raises UserError."""
    data = path.read_bytes()
    corners = _text(data) if _is_text(data) else _binary(data)
    if not len(corners):
        raise UserError(EMPTY)
    return Mesh(corners.reshape(-1, 3).astype(np.float64), np.arange(3 * len(corners)).reshape(-1, 3))


def _count(data: bytes) -> int:
    return int.from_bytes(data[HEADER - 4 : HEADER], "little")


def _is_text(data: bytes) -> bool:
    """Whether a file is text: binary files may begin with "solid", too, but then their size fits their count."""
    if len(data) >= HEADER and len(data) == HEADER + TRIANGLE.itemsize * _count(data):
        return False
    return re.match(rb"\s*solid\b", data, re.IGNORECASE) is not None and b"\0" not in data[: 8 * HEADER]


def _binary(data: bytes) -> np.typing.NDArray[np.float32]:
    """Return the corners (F, 3, 3). Bytes after the last triangle are ignored."""
    count = _count(data)
    there = max(0, len(data) - HEADER) // TRIANGLE.itemsize
    if count in UNKNOWN:
        count = there
    if len(data) < HEADER or count > there:
        raise UserError(f"not a readable STL file (it ends after {there:,} of {count:,} triangles)")
    return np.asarray(np.frombuffer(data, TRIANGLE, count, HEADER)["corners"])


def _text(data: bytes) -> np.typing.NDArray[np.float64]:
    """Return the corners (F, 3, 3) of a text of any number of solids."""
    data = data.replace(b"\r", b"\n")
    # Not \s before the word: each of many blank lines would be searched up to the next word.
    rows = re.findall(rb"^[ \t]*vertex\s+(\S+)[ \t]+(\S+)[ \t]+(\S+)", data, re.MULTILINE | re.IGNORECASE)
    try:
        numbers = np.array([float(word) for row in rows for word in row]).reshape(-1, 3)
    except ValueError:
        raise UserError("not a readable STL file (a vertex is no number)") from None
    if len(numbers) % 3:
        raise UserError("not a readable STL file (a triangle has fewer than three vertices)")
    return np.asarray(numbers.reshape(-1, 3, 3))
