"""Makes a point cloud of columns or arrays, and says in a warning what was not used."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from .column_names import NAMES, SKIP, plain, roles_of, unused
from .columns import PACKED, stacked, typed_colors, unpacked, untyped_colors
from .content import Cloud, Facts, Mesh
from .guess import guessed_roles
from .paint import Material, Paint
from .values import CornerValues, Doubles

CONSTANT_HARMONIC = 0.28209479177387814
"""Value of the constant spherical harmonic, 1 / (2 sqrt(pi)): a splat's f_dc is a coefficient of it."""
FAINT = 0.3  # splats of lower opacity are left out
EMPTY = "the mesh is empty; a shape needs triangles or points"
MOST_NAMES = 8  # names in the warning of what was not used
ARRAYS = {
    **dict.fromkeys(("points", "xyz", "vertices", "verts", "positions", "position", "pos", "coords", "pts"), "points"),
    **dict.fromkeys(("point", "pc", "pcd", "pointcloud", "cloud", "vertex", "v", "coordinates", "locations"), "points"),
    **dict.fromkeys(("normals", "normal", "n", "nrm", "nxnynz", "vertexnormals", "pointnormals", "vn"), "normals"),
    **dict.fromkeys(("colors", "colours", "color", "colour", "rgb", "rgbs", "vertexcolors", "pointcolors"), "colors"),
    **dict.fromkeys(("vertexcolours", "pointcolours", "rgba", "c", "vc"), "colors"),
    **dict.fromkeys(("faces", "face", "triangles", "tris", "f", "simplices", "cells"), "faces"),
}
"""Name of an array, as `plain` returns it -> what it holds."""


def cloud_of_columns(
    names: Sequence[str], columns: Sequence[NDArray[Any]], chosen: Sequence[str] | None = None, *, typed: bool = True
) -> Cloud:
    """Make a cloud of columns (N,), by their names. Raises UserError.

    chosen: roles by place. typed: whether the columns' types say how large their colors are; else their range does.
    """
    roles = roles_of(names, chosen)
    points = stacked(columns, roles, "x y z")
    if points is None or not len(points):
        raise UserError(EMPTY if points is not None or not names else f"no columns x, y, z; it has {_listed(names)}")
    facts = Facts()
    normals, rgb = stacked(columns, roles, "nx ny nz"), stacked(columns, roles, "r g b")
    used = [roles[axis] for axis in "xyz"]
    used += [roles[f"n{axis}"] for axis in "xyz"] if normals is not None else []
    used += [roles[channel] for channel in "rgb"] if rgb is not None else []
    colors = None if rgb is None else typed_colors(rgb) if typed else untyped_colors(rgb.astype(np.float64))
    by_name = {plain(name): np.asarray(column) for name, column in zip(names, columns, strict=True)}
    if chosen is None and (splats := _splats(by_name)) is not None:
        colors, opaque = splats
        facts.taken.append(f"{np.count_nonzero(opaque):,} opaque splats of {len(opaque):,}")
        return finite_cloud(points.astype(np.float64)[opaque], None, colors[opaque], facts)
    packed = next((place for place, name in enumerate(names) if plain(name) in PACKED), None)
    if colors is None and chosen is None and packed is not None:
        colors, used = unpacked(np.asarray(columns[packed])) / 255, [*used, packed]
    if left := unused(names, used):
        facts.warnings.append(f"columns that are not used: {_listed(left)}")
    facts.taken.append("columns " + " ".join(show(names[place]) for place in sorted(used)))
    return finite_cloud(
        points.astype(np.float64), None if normals is None else normals.astype(np.float64), colors, facts
    )


def _splats(columns: Mapping[str, NDArray[Any]]) -> tuple[Doubles, NDArray[np.bool_]] | None:
    """Return the colors (N, 3) of Gaussian splats, and which are opaque (N,); None for other points."""
    harmonics = [columns.get(f"fdc{k}") for k in range(3)]
    values = [np.asarray(column, np.float64) for column in harmonics if column is not None]
    if len(values) < 3:
        return None
    colors = np.clip(0.5 + CONSTANT_HARMONIC * np.stack(values, axis=1), 0, 1)
    logits = columns.get("opacity")  # the file has the logit of the opacity
    opaque = np.ones(len(colors), np.bool_) if logits is None else logits >= np.log(FAINT / (1 - FAINT))
    return colors, opaque


def cloud_of_table(table: Doubles, chosen: Sequence[str] | None = None) -> Cloud:
    """Make a cloud of a table (N, K) without names: by `chosen`, or by the columns' lengths and ranges."""
    roles = tuple(chosen) if chosen is not None else guessed_roles(table)
    if len(roles) > table.shape[1]:
        raise UserError(f"--columns: {len(roles)} names, and the file has {table.shape[1]} columns")
    named = [role if role not in SKIP else "" for role in roles] + [""] * (table.shape[1] - len(roles))
    names = [name or f"{place + 1} (of {table.shape[1]})" for place, name in enumerate(named)]
    return cloud_of_columns(names, list(table.T), [*named], typed=False)


def content_of_arrays(arrays: Mapping[str, NDArray[Any]], chosen: Sequence[str] | None = None) -> Cloud | Mesh:
    """Make a cloud, or a mesh where there are faces, of named arrays; it asks for no others. Raises UserError."""
    found: dict[str, NDArray[Any]] = {}
    for name in arrays:
        role = ARRAYS.get(plain(name))
        if role is not None and role not in found:
            found[role] = np.asarray(arrays[name])
    if "points" not in found:
        named = {name: np.asarray(arrays[name]) for name in arrays if chosen or plain(name) in NAMES}
        flat = {name: array.reshape(-1) for name, array in named.items() if array.ndim <= 2}
        if {"x", "y", "z"} <= set(roles_of(list(flat))):
            return cloud_of_columns(list(flat), list(flat.values()), chosen)
        raise UserError(f"the array `points` is missing; it has {_listed(list(arrays))}")
    points = found["points"]
    if points.ndim != 2 or points.shape[1] < 3:
        raise UserError(f"array `points` has shape {points.shape}, expected (N, 3)")
    facts = Facts()
    others = [name for name in arrays if ARRAYS.get(plain(name)) not in found]
    if others:
        facts.warnings.append(f"arrays that are not used: {_listed(others)}")
    if points.shape[1] > 3:
        cloud = cloud_of_table(points.astype(np.float64), chosen)
        points, facts.warnings = cloud.points, facts.warnings + cloud.facts.warnings
        if cloud.normals is not None:
            found.setdefault("normals", cloud.normals)
        if cloud.colors is not None:
            found.setdefault("colors", cloud.colors)
    for name in ("normals", "colors"):
        shape = found[name].shape if name in found else (len(points), 3)
        if len(shape) != 2 or shape[0] != len(points) or shape[1] < 3:
            raise UserError(f"array `{name}` has shape {shape}, expected ({len(points)}, 3)")
    normals = found["normals"][:, :3].astype(np.float64) if "normals" in found else None
    colors = typed_colors(found["colors"][:, :3]) if "colors" in found else None
    if "faces" in found:
        return mesh_of_arrays(points[:, :3].astype(np.float64), found["faces"], normals, colors, facts)
    return finite_cloud(points[:, :3].astype(np.float64), normals, colors, facts)


def mesh_of_arrays(
    points: Doubles, faces: NDArray[Any], normals: Doubles | None, colors: Doubles | None, facts: Facts | None = None
) -> Mesh:
    """Make a mesh of vertices (V, 3) and faces (F, 3), which may be floats of whole numbers. Raises UserError."""
    if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        raise UserError(f"faces of shape {faces.shape}; (F, 3) is needed")
    whole = faces.astype(np.int64)
    if (whole != faces).any():
        raise UserError("faces are not whole numbers")
    if whole.min() < 0 or whole.max() >= len(points):
        raise UserError("faces refer to missing vertices")
    paint = None
    if colors is not None:
        paint = Paint((Material(),), np.zeros(len(whole), np.int64), colors=CornerValues(colors, whole))
    given = None if normals is None else CornerValues(normals, whole)
    return Mesh(points, whole, given, paint, facts or Facts())


def finite_cloud(points: Doubles, normals: Doubles | None, colors: Doubles | None, facts: Facts) -> Cloud:
    """Make a cloud; leave out points without finite coordinates or without a normal, with a warning that counts them.

    Colors that are all black are none: many programs write them where they have none. Where no point has a normal, the
    cloud has none. Where most points are damaged, all stay, for `check_cloud` to say.
    """
    kept = np.asarray(np.isfinite(points).all(axis=1))
    if normals is not None:
        with np.errstate(invalid="ignore"):
            directed = np.isfinite(normals).all(axis=1) & normals.any(axis=1)
        if not normals.any():
            normals = None
        else:
            kept = kept & directed
    if colors is not None and not colors.any():
        colors = None
        facts.warnings.append("all colors are black: left out")
    cloud = Cloud(points, normals, colors, facts)
    lost = int(np.count_nonzero(~kept))
    if not lost or 2 * lost > len(kept):
        return cloud
    facts.warnings.append(f"left out {lost:,} points without finite coordinates or a normal")
    return cloud.take(kept)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(map(show, names[:MOST_NAMES])) + more
