"""Reads tables of numbers from text: spaces, tabs, commas or semicolons; a header, a count, and comments."""

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.errors import UserError
from ..model.files import show
from .column_names import NAMES, plain
from .values import Doubles

MOST_HEADER = 50  # lines before the numbers
MOST_COLUMNS = 256
MISSING = ("", "nan", "-nan", "null", "none", "na", "n/a", "-")
"""Cells without a number, in lower case."""


@dataclass(frozen=True, eq=False)
class Table:
    """A table of numbers."""

    names: list[str] | None
    """Of the columns, from a header; None without one."""
    rows: Doubles
    """(N, K)."""


def read_table(path: Path) -> Table:
    """Read a table from a text file. Raises UserError."""
    data = path.read_bytes()
    if b"\0" in data[:4096] and not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise UserError(f"not a readable {path.suffix[1:].upper()} file (it is not text)")
    text = _decoded(data)
    lines = [line for line in re.split(r"\r\n|\r|\n", text) if line.strip()]
    delimiter, decimal = _separators(lines)
    cells = [_cells(line, delimiter, decimal) for line in lines[:MOST_HEADER]]
    # Rows of numbers alone; or, in a table with columns of words, rows with three numbers.
    rows_of = [[k for k, each in enumerate(cells) if test(each)] for test in (_is_row, _has_numbers)]
    start = next((found[0] for found in rows_of if found), MOST_HEADER)
    head = lines[:start]
    body = [line for line in lines[start:] if not line.lstrip().startswith(("#", "//"))]
    # A count comes before the rows, or alone in the first of them.
    if len(body) > 1 and len(_cells(body[0], delimiter, decimal)) == 1 < len(_cells(body[1], delimiter, decimal)):
        body = body[1:]
    if not body or start >= len(cells):
        raise UserError(f"not a readable {path.suffix[1:].upper()} file (no rows of numbers)")
    rows = _numbers(body, delimiter, decimal, path.suffix[1:].upper())
    if rows.shape[1] > MOST_COLUMNS:
        raise UserError(f"a table of {rows.shape[1]:,} columns; at most {MOST_COLUMNS} are read")
    return Table(_names(head, delimiter, rows.shape[1]), rows)


def _decoded(data: bytes) -> str:
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            return data.decode(encoding, errors="replace")
    return data.decode("latin-1")


def _separators(lines: list[str]) -> tuple[str | None, bool]:
    """Return the delimiter, None for blanks, and whether decimals have a comma."""
    sample = lines[len(lines) // 2] if lines else ""
    if ";" in sample:
        return ";", "," in sample and "." not in sample
    words = sample.split()
    if len(words) > 2 and "." not in sample and all(re.fullmatch(r"[-+\deE]*(,[\deE+-]+)?", word) for word in words):
        return None, "," in sample  # 1,5 2,5 3,5
    return ("," if "," in sample else None), False


def _cells(line: str, delimiter: str | None, decimal: bool) -> list[str]:
    cells = line.split(delimiter) if delimiter else line.split()
    cells = [cell.strip().strip('"') for cell in cells]
    while delimiter and cells and not cells[-1]:
        cells.pop()  # a delimiter at the end of a line
    return [cell.replace(",", ".") for cell in cells] if decimal else cells


def _is_row(cells: list[str]) -> bool:
    """Whether cells are numbers, of which some may be missing."""
    return bool(cells) and all(_value(cell) is not None for cell in cells) and any(map(_is_number, cells))


def _has_numbers(cells: list[str]) -> bool:
    return sum(map(_is_number, cells)) >= 3


def _is_number(cell: str) -> bool:
    return cell.lower() not in MISSING and _value(cell) is not None


def _value(cell: str) -> float | None:
    if cell.lower() in MISSING:
        return np.nan
    try:
        return float(cell)
    except ValueError:
        return None


def _numbers(body: list[str], delimiter: str | None, decimal: bool, kind: str) -> Doubles:
    """Read rows of numbers, fast where all cells are numbers. Raises UserError."""
    if not decimal:
        text = io.StringIO("\n".join(line.rstrip().rstrip(delimiter) if delimiter else line for line in body))
        try:
            return np.loadtxt(text, ndmin=2, dtype=np.float64, delimiter=delimiter, comments=("#", "//"))
        except ValueError:
            pass
    found = []
    for number, line in enumerate(body, start=1):
        cells = _cells(line, delimiter, decimal)
        values = [_value(cell) for cell in cells]
        wrong = next((cell for cell, value in zip(cells, values, strict=True) if value is None), None)
        if wrong is not None and not _has_numbers(cells):
            raise UserError(f"not a readable {kind} file (row {number}: {show(wrong)[:40]!r} is no number)")
        found.append([np.nan if value is None else value for value in values])
    width = max(map(len, found))
    if short := sum(len(row) < width for row in found):
        if 2 * short > len(found) or not delimiter:
            raise UserError(f"not a readable {kind} file (its rows have {min(map(len, found))} to {width} numbers)")
        found = [[*row, *[np.nan] * (width - len(row))] for row in found]
    return np.array(found, np.float64)


def _names(head: list[str], delimiter: str | None, width: int) -> list[str] | None:
    """Return the names of the columns: the last line before the numbers that has a name for each."""
    for line in reversed(head):
        bare = line.strip().lstrip("#/;%! ").strip()
        for cells in (
            next(csv.reader([bare], delimiter=delimiter or ","), []),
            bare.split(),
            re.split(r"[,;\t]", bare),
        ):
            names = [cell.strip().strip('"') for cell in cells]
            known = {NAMES.get(plain(name)) for name in names}
            if len(names) == width and {"x", "y", "z"} <= known:
                return names
    return None
