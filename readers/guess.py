"""Tells normals from colors in a table of numbers without names, by their lengths and ranges."""

import numpy as np

from ..model.errors import UserError
from .values import Doubles

MOST = 0.95  # share of the rows that must agree
UNIT = 0.02  # largest deviation of a normal's length from 1
REMEDY = "name them, as in --columns x,y,z,nx,ny,nz,r,g,b"


def guessed_roles(table: Doubles) -> tuple[str, ...]:
    """Return the roles of the columns of a table (N, K); "-" for a column that is not used. Raises UserError."""
    width = table.shape[1]
    if width < 3:
        raise UserError(f"{width} columns; x y z [nx ny nz] [r g b] are needed")
    rows = table[np.isfinite(table).all(axis=1)]
    if width > 3 and len(rows) > 2 and (np.diff(rows[:, 0]) == 1).all():
        return "-", *guessed_roles(table[:, 1:])  # numbers of the rows
    roles = ["x", "y", "z"] + ["-"] * (width - 3)
    if not len(rows):
        return tuple(roles)
    exact = width in (6, 9)
    starts = range(3, width - 2, 3) if exact else range(3, width - 2)
    kinds = {start: _kind(rows[:, start : start + 3], unit_only=not exact) for start in starts}
    normals = [start for start, kind in kinds.items() if kind == "normals"]
    if len(normals) > 1:
        if exact:
            raise UserError(f"{width} columns, and it is not clear which are normals; {REMEDY}")
        normals = normals[:1]
    if unclear := [start for start, kind in kinds.items() if kind == "either"]:
        raise UserError(f"columns {unclear[0] + 1} to {unclear[0] + 3} may be normals or colors; {REMEDY}")
    of_unit = {start for start in normals if _kind(rows[:, start : start + 3], unit_only=True) == "normals"}
    if normals and not of_unit and _whole(rows[:, :3]) and _kind(rows[:, :3], unit_only=True) == "colors":
        raise UserError(f"columns 1 to 3 may be points or colors; {REMEDY}")
    if normals:
        roles[normals[0] : normals[0] + 3] = ["nx", "ny", "nz"]
    free = [
        start
        for start, kind in kinds.items()
        if kind == "colors" and all(role == "-" for role in roles[start : start + 3])
    ]
    if len(free) > 1 and exact:
        raise UserError(f"{width} columns, and it is not clear which are colors; {REMEDY}")
    if free:
        start = _colors_of(rows, free)
        roles[start : start + 3] = ["r", "g", "b"]
    return tuple(roles)


def _kind(values: Doubles, unit_only: bool) -> str:
    """Say what three columns (N, 3) hold: "normals", "colors", "either", or "" for neither.

    unit_only: whether only unit vectors are normals. Normals have negative components, and are short.
    """
    if not values.any():
        return ""
    lengths = np.linalg.norm(values, axis=1)
    are_unit = np.mean((np.abs(lengths - 1) < UNIT) | (lengths == 0)) >= MOST
    if values.min() < 0:
        return "normals" if are_unit or not unit_only else ""
    if are_unit:
        return "either"
    high = values.max()
    in_range = high <= 1 or high <= 255 or (_whole(values) and high <= 65535)
    return "colors" if in_range else ""


def _whole(values: Doubles) -> bool:
    return bool((values == np.round(values)).all())


def _colors_of(rows: Doubles, starts: list[int]) -> int:
    """Choose among places of colors: those of whole numbers, beside a constant intensity or opacity.

    Raises UserError where a column that varies may be a color or not.
    """
    starts = [start for start in starts if _whole(rows[:, start : start + 3])] or starts
    first, last = rows[:, starts[0]], rows[:, starts[-1] + 2]
    if len(starts) == 1 or (first == first[0]).all():
        return starts[-1]
    if (last == last[0]).all():
        return starts[0]
    raise UserError(f"columns {starts[0] + 1} to {starts[-1] + 3}, and it is not clear which are colors; {REMEDY}")
