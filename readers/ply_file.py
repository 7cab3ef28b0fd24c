"""Reads the elements of a PLY file: a header, then rows of numbers and lists, as text or bytes (Turk 1994).

Why not a library: trimesh refuses rows of different lengths, plyfile is under the GPL, meshio drops properties.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from .text_numbers import numbers

TYPES = {
    **{"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2"},
    **{"uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4"},
    **{"double": "f8", "float64": "f8", "int64": "i8", "uint64": "u8"},
}
"""PLY's name of a type -> NumPy's."""
LONGEST_HEADER = 1 << 20  # bytes
DAMAGED = "not a readable PLY file"


@dataclass(frozen=True)
class Property:
    """A column of an element."""

    name: str
    kind: str
    """NumPy's type of its numbers."""
    count: str = ""
    """NumPy's type of a list's length; "" for a single number."""


@dataclass(frozen=True, eq=False)
class Lists:
    """A column of lists."""

    sizes: NDArray[np.int64]
    """(N,), the length of each list."""
    values: NDArray[Any]
    """All lists, one after the other."""


@dataclass(eq=False)
class Element:
    """An element, such as `vertex`, with its columns."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    lists: dict[str, Lists] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Ply:
    """The content of a PLY file."""

    elements: dict[str, Element]
    comments: list[str]


def read_elements(path: Path) -> Ply:
    """Read a PLY file. Raises UserError."""
    data = path.read_bytes()
    head = data[:LONGEST_HEADER]
    found = re.match(rb"\s*ply[ \t]*(\r\n|\n|\r)", head)
    # The line that ends the header ends as the others do: a byte of the data may look like a line feed.
    end = found and re.search(rb"(?<=[\r\n])end_header[ \t]*" + found[1], head)
    if not found or not end:
        raise UserError(f"{DAMAGED} (no header)")
    lines = head[: end.start()].decode("latin-1").splitlines()
    encoding, elements, comments = _header(lines)
    if encoding == "ascii":
        _read_text(data[end.end() :], elements)
    else:
        _read_bytes(data, end.end(), elements, "<" if "little" in encoding else ">")
    return Ply({element.name: element for element in elements}, comments)


def _header(lines: list[str]) -> tuple[str, list[Element], list[str]]:
    encoding, elements, comments = "", list[Element](), list[str]()
    for line in lines:
        words = line.split()
        try:
            match words:
                case ["format", encoding, *_] if encoding in ("ascii", "binary_little_endian", "binary_big_endian"):
                    pass
                case ["comment" | "obj_info", *_]:
                    comments.append(line.strip().partition(" ")[2].strip())
                case ["element", name, count, *_]:
                    elements.append(Element(name, int(count)))
                case ["property", "list", count, kind, name, *_]:
                    elements[-1].properties.append(Property(name, TYPES[kind], TYPES[count]))
                case ["property", kind, name, *_]:
                    elements[-1].properties.append(Property(name, TYPES[kind]))
        except (ValueError, KeyError, IndexError):
            raise UserError(f"{DAMAGED} (in its header: {show(line)[:80]})") from None
    if not encoding or any(element.count < 0 for element in elements):
        raise UserError(f"{DAMAGED} (no known format)")
    return encoding, elements, comments


def _read_text(data: bytes, elements: list[Element]) -> None:
    """Fill the columns from text."""
    try:
        words = numbers(data.decode("latin-1"))
    except ValueError:
        raise UserError(f"{DAMAGED} (a word in place of a number)") from None
    at = 0
    for element in elements:
        if not _lists_of(element):
            width = len(element.properties)
            rows = words[at : at + width * element.count]
            if len(rows) < width * element.count:
                raise _too_short(element)
            table = rows.reshape(element.count, width) if width else rows
            for k, each in enumerate(element.properties):
                element.columns[each.name] = table[:, k].astype(each.kind)
            at += width * element.count
            continue
        at = _text_lists(words, at, element)


def _text_lists(words: NDArray[np.float64], at: int, element: Element) -> int:
    """Fill the columns of an element with lists. Returns the place after it."""
    starts: dict[str, list[int]] = {each.name: [] for each in element.properties}
    lengths: dict[str, list[int]] = {each.name: [] for each in element.properties}
    try:
        for _ in range(element.count):
            for each in element.properties:
                length = 1
                if each.count:
                    length, at = int(words[at]), at + 1
                if length < 0 or at + length > len(words):
                    raise _too_short(element)
                starts[each.name].append(at)
                lengths[each.name].append(length)
                at += length
    except (IndexError, ValueError, OverflowError):
        raise _too_short(element) from None
    for each in element.properties:
        first, sizes = np.array(starts[each.name], np.int64), np.array(lengths[each.name], np.int64)
        values = words[_ranges(first, sizes)].astype(each.kind)
        if each.count:
            element.lists[each.name] = Lists(sizes, values)
        else:
            element.columns[each.name] = values
    return at


def _read_bytes(data: bytes, at: int, elements: list[Element], order: str) -> None:
    """Fill the columns from bytes. order: of the bytes, "<" or ">"."""
    for element in elements:
        at = _byte_rows(data, at, element, order)


def _byte_rows(data: bytes, at: int, element: Element, order: str) -> int:
    """Fill the columns of an element. Returns the place after it."""
    if not element.count or not element.properties:
        return at
    regular = _regular_row(data, at, element, order)
    if regular is not None:
        rows = np.frombuffer(data, regular, element.count, at)
        if all((rows[f"count {k}"] == rows[f"list {k}"].shape[1]).all() for k in _lists_of(element)):
            for k, each in enumerate(element.properties):
                if each.count:
                    table = rows[f"list {k}"]
                    sizes = np.full(element.count, table.shape[1], np.int64)
                    element.lists[each.name] = Lists(sizes, table.reshape(-1).astype(each.kind))
                else:
                    element.columns[each.name] = rows[f"column {k}"].astype(each.kind)
            return at + regular.itemsize * element.count
    return _irregular_rows(data, at, element, order)


def _lists_of(element: Element) -> list[int]:
    return [k for k, each in enumerate(element.properties) if each.count]


def _regular_row(data: bytes, at: int, element: Element, order: str) -> np.dtype[Any] | None:
    """Return the type of a row if all rows are like the first; None if there is not enough data for that."""
    fields: list[Any] = []
    place = at
    for k, each in enumerate(element.properties):
        kind = np.dtype(order + each.kind)
        if not each.count:
            fields.append((f"column {k}", kind))
            place += kind.itemsize
            continue
        count = np.dtype(order + each.count)
        if place + count.itemsize > len(data):
            return None
        length = int(np.frombuffer(data, count, 1, place)[0])
        if length < 0 or length > len(data):
            return None
        fields += [(f"count {k}", count), (f"list {k}", kind, (length,))]
        place += count.itemsize + length * kind.itemsize
    row = np.dtype(fields)
    if at + row.itemsize * element.count <= len(data):
        return row
    if not _lists_of(element):
        raise _too_short(element)
    return None


def _irregular_rows(data: bytes, at: int, element: Element, order: str) -> int:
    """Fill the columns of rows of different lengths. Returns the place after them."""
    starts: list[list[int]] = [[] for _ in element.properties]
    lengths: list[list[int]] = [[] for _ in element.properties]
    kinds = [
        (np.dtype(order + each.kind).itemsize, np.dtype(order + (each.count or "u1")).itemsize if each.count else 0)
        for each in element.properties
    ]
    signs = [each.count.startswith("i") for each in element.properties]
    little = "little" if order == "<" else "big"
    for _ in range(element.count):
        for k, (size, counted) in enumerate(kinds):
            length = 1
            if counted:
                length = int.from_bytes(data[at : at + counted], little, signed=signs[k])  # type: ignore[arg-type]
                at += counted
            starts[k].append(at)
            lengths[k].append(length)
            at += size * length
            if length < 0 or at > len(data):
                raise _too_short(element)
    raw = np.frombuffer(data, np.uint8)
    for k, each in enumerate(element.properties):
        kind = np.dtype(order + each.kind)
        first, sizes = np.array(starts[k], np.int64), np.array(lengths[k], np.int64)
        values = raw[_ranges(first, sizes * kind.itemsize)].view(kind).astype(each.kind)
        if each.count:
            element.lists[each.name] = Lists(sizes, values)
        else:
            element.columns[each.name] = values
    return at


def _ranges(starts: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Concatenate the ranges that begin at starts (N,) and have these sizes (N,)."""
    ends = np.cumsum(sizes)
    return np.asarray(np.arange(ends[-1] if len(ends) else 0) + np.repeat(starts - (ends - sizes), sizes))


def _too_short(element: Element) -> UserError:
    return UserError(f"{DAMAGED} (it ends before the last of {f'{element.count:,}'[:40]} rows of {show(element.name)})")
