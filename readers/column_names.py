"""The names of the columns of points, in many programs' files.

One table serves PLY, text, NPZ and arrays. The names are those of PLY's authors, Open3D, PCL, MeshLab, CloudCompare,
PDAL and Blender, in lower case and without the signs between words.
"""

import re
from collections.abc import Sequence

from ..model.errors import UserError

ROLES = ("x", "y", "z", "nx", "ny", "nz", "r", "g", "b")
"""Roles of columns, as `--columns` names them."""
SKIP = ("", "-", "_")
"""Names in `--columns` of a column that is not used."""
_NORMAL = ("n{0}", "normal{0}", "normals{0}", "norm{0}", "n{0}s", "vertexnormal{0}")
_COLOR = ("{1}", "{0}", "diffuse{1}", "color{0}", "colour{0}", "color{1}", "colour{1}", "col{0}", "vertex{1}", "{0}f")
_PLACE = ("{0}", "pos{0}", "position{0}", "point{0}", "points{0}", "p{0}", "v{0}", "coord{0}", "{0}coord", "co{0}")
NAMES: dict[str, str] = {
    **{form.format(axis): axis for axis in "xyz" for form in _PLACE},
    **{form.format(axis): f"n{axis}" for axis in "xyz" for form in _NORMAL},
    **{f"normal{k}": f"n{axis}" for k, axis in enumerate("xyz")},
    **{form.format(c, name): c for c, name in zip("rgb", ("red", "green", "blue"), strict=True) for form in _COLOR},
    **{name: role for role in "uv" for name in (role, f"texture{role}", f"tex{role}", f"uv{role}", f"texcoord{role}")},
    **{"s": "u", "t": "v", "s0": "u", "t0": "v", "texcoord0": "u", "texcoord1": "v", "textures": "u", "texturet": "v"},
}
"""Name of a column, as `plain` returns it -> role. The first column of a role is used."""
QUIET = {"alpha", "a", "diffusealpha", "colora", "vertexalpha", "af"}
"""Names of columns that nobody misses."""


def plain(name: str) -> str:
    """Return a column's name in lower case, with its letters and digits alone: "//X" and "X [m]" are "x"."""
    return re.sub(r"[\[(].*|[^a-z0-9]", "", name.strip().lower())


def roles_of(names: Sequence[str], chosen: Sequence[str] | None = None) -> dict[str, int]:
    """Return role -> place of its column. names: of the columns. chosen: roles by place, of `--columns`.

    Raises UserError where `chosen` has another number of names than there are columns.
    """
    if chosen is not None:
        if len(chosen) > len(names):
            raise UserError(f"--columns: {len(chosen)} names, and the file has {len(names)} columns")
        return {role: place for place, role in enumerate(chosen) if role not in SKIP}
    found: dict[str, int] = {}
    for place, name in enumerate(names):
        role = NAMES.get(plain(name))
        if role is not None and role not in found:
            found[role] = place
    return found


def parse_columns(text: str | Sequence[str] | None) -> tuple[str, ...] | None:
    """Read the roles of `--columns`. Raises UserError."""
    if text is None:
        return None
    names = [name.strip() for name in (text.split(",") if isinstance(text, str) else text)]
    roles = tuple(name if name in SKIP else NAMES.get(plain(name), "") or _refuse(name) for name in names)
    if not {"x", "y", "z"} <= set(roles):
        raise UserError(f"--columns {','.join(names)}: x, y and z are needed")
    used = [role for role in roles if role not in SKIP]
    if len(used) != len(set(used)):
        raise UserError(f"--columns {','.join(names)}: a name is there twice")
    return roles


def _refuse(name: str) -> str:
    raise UserError(f"--columns: {name!r} is none of {', '.join(ROLES)}, or - for a column that is not used")


def unused(names: Sequence[str], used: Sequence[int]) -> list[str]:
    """List the names of the columns whose places are not in `used`, without those that nobody misses."""
    left = [place for place, name in enumerate(names) if place not in used and plain(name) not in QUIET]
    return [names[place] or f"{place + 1} (of {len(names)})" for place in left]
