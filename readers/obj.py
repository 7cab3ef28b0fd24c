"""Reads OBJ files: polygons with texture coordinates, normals, materials and colors of vertices; or points alone."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.references import Folder
from .clouds import EMPTY, finite_cloud
from .columns import untyped_colors
from .content import Cloud, Facts, Mesh
from .obj_paint import obj_paint
from .paint import UNREAL
from .polygons import triangulated
from .text_numbers import numbers
from .values import CornerValues, Doubles, Integers

MOST_COLUMNS = 8  # numbers of a line that are read, where lines differ: x y z, a weight, and a color
NONE = -1  # a corner without texture coordinates or normal


@dataclass
class Lines:
    """The statements of an OBJ, by kind."""

    vertices: list[str] = field(default_factory=list)
    coordinates: list[str] = field(default_factory=list)
    normals: list[str] = field(default_factory=list)
    faces: list[str] = field(default_factory=list)
    counts: list[tuple[int, int, int]] = field(default_factory=list)
    """Numbers of vertices, coordinates and normals before each face, for its negative indices."""
    materials: list[tuple[int, str]] = field(default_factory=list)
    """First face and name of each `usemtl`."""
    libraries: list[str] = field(default_factory=list)
    groups: set[str] = field(default_factory=set)


def read_obj(path: Path, image: Path | None, chosen: Sequence[str] | None = None, follow: bool = False) -> Mesh | Cloud:
    """Read an OBJ file; without faces, its vertices are a cloud. Raises UserError.

    image: replaces the materials'. follow: of `Folder`, for the names of materials and images.
    """
    lines = _sorted(path)
    vertices = _numbers(lines.vertices, "v")
    if not len(vertices):
        raise UserError(EMPTY)
    if vertices.shape[1] < 3:
        raise UserError(f"points have {vertices.shape[1]} coordinates; three are needed")
    facts = Facts(meshes=max(1, len(lines.groups)))
    colors = _vertex_colors(vertices, facts)
    points = vertices[:, :3]
    if not lines.faces:
        normals = _numbers(lines.normals, "vn")
        directed = normals if normals.shape == (len(points), 3) else None
        return finite_cloud(points, directed, colors, Facts(warnings=facts.warnings))
    sizes, corners = _corners(lines, len(points))
    triangles, owners = triangulated(points, sizes, corners[:, 0])
    index = corners[triangles]
    coordinates, normals = _numbers(lines.coordinates, "vt"), _numbers(lines.normals, "vn")
    has_uv = index[:, :, 1] != NONE
    uv = CornerValues(coordinates[:, :2], np.maximum(index[:, :, 1], 0)) if has_uv.any() else None
    if uv is not None and not np.isfinite(uv.values).all():
        raise UserError(UNREAL)
    facts.unwrapped = uv is not None
    painted = None if colors is None else CornerValues(colors, index[:, :, 0])
    names, material = _materials_of(lines, owners)
    paint = obj_paint(
        Folder(path.parent, follow), lines.libraries, names, material, uv, has_uv.all(axis=1), painted, image, facts
    )
    given = None
    if len(normals) and normals.shape[1] == 3 and (index[:, :, 2] != NONE).all():
        given = CornerValues(normals, index[:, :, 2])
    return Mesh(points, np.ascontiguousarray(index[:, :, 0]), given, paint, facts)


def _vertex_colors(vertices: Doubles, facts: Facts) -> Doubles | None:
    """Return the colors (V, 3) after the coordinates: x y z r g b, also with a weight or an opacity; None without.

    Vertices without a color have the mean color.
    """
    width = vertices.shape[1]
    if width < 6:
        return None
    start = 4 if width == 7 and (vertices[:, 3] == 1).all() else 3
    colors = untyped_colors(vertices[:, start : start + 3])
    bare = ~np.isfinite(colors).all(axis=1)
    if bare.all():
        return None
    if bare.any():
        facts.warnings.append(f"{np.count_nonzero(bare):,} vertices without a color have the mean color")
        colors[bare] = colors[~bare].mean(axis=0)
    return colors


def _sorted(path: Path) -> Lines:
    """Sort the lines of a file by their keywords, without comments."""
    text = path.read_bytes().decode("utf-8-sig", errors="surrogateescape")
    if "\0" in text[:4096]:
        raise UserError("not a readable OBJ file (it is not text)")
    found = Lines()
    kinds = {"v": found.vertices, "vt": found.coordinates, "vn": found.normals}
    for line in re.sub(r"\\[ \t]*(\r\n|\r|\n)", " ", text).splitlines():
        keyword, _, rest = line.strip().replace("\t", " ").partition(" ")
        if keyword in kinds:
            kinds[keyword].append(rest.partition("#")[0])
        elif keyword in ("f", "fo"):
            found.faces.append(rest.partition("#")[0])
            found.counts.append((len(found.vertices), len(found.coordinates), len(found.normals)))
        elif keyword == "usemtl":
            found.materials.append((len(found.faces), rest.strip()))
        elif keyword == "mtllib":
            found.libraries.append(rest.strip())
        elif keyword == "o":
            found.groups.add(rest.strip())
    return found


def _numbers(lines: list[str], keyword: str) -> Doubles:
    """Read rows of numbers (N, K). Rows of other lengths are cut or filled: coordinates with 0, colors with NaN."""
    if not lines:
        return np.zeros((0, 3))
    try:
        flat = numbers(" ".join(lines))
        width = len(lines[0].split())
        if len(flat) == width * len(lines) and len(lines[-1].split()) == width:
            return np.asarray(flat.reshape(len(lines), width))
        rows = [[float(word) for word in line.split()] for line in lines]
    except ValueError:
        raise UserError(f"not a readable OBJ file (a line {keyword} has a word in place of a number)") from None
    widths = [len(row) for row in rows]
    width = min(Counter(widths).most_common(1)[0][0], MOST_COLUMNS)
    if keyword == "v" and max(widths) >= 6:
        width = min(max(widths), MOST_COLUMNS)
    return np.array([(row + [0.0] * (3 - len(row)) + [np.nan] * width)[:width] for row in rows], np.float64)


def _corners(lines: Lines, vertices: int) -> tuple[Integers, Integers]:
    """Read the corners of all faces: the number of each face's (P,), and their three indices (C, 3), NONE if absent."""
    words = [face.split() for face in lines.faces]
    sizes = np.array([len(face) for face in words], np.int64)
    flat = [word for face in words for word in face]
    slashes = flat[0].count("/") if flat else 0
    joined = " ".join(flat)
    try:
        if joined.count("/") == slashes * len(flat) and all(word.count("/") == slashes for word in flat):
            spaced = joined.replace("//", "/0/").replace("/ ", "/0 ").replace("/", " ")
            spaced += "0" if joined.endswith("/") else ""
            table = numbers(spaced).astype(np.int64).reshape(len(flat), slashes + 1)
        else:
            table = np.array([[int(part or 0) for part in [*word.split("/"), "", ""][:3]] for word in flat], np.int64)
    except ValueError:
        raise UserError("not a readable OBJ file (a face has a corner that is no number)") from None
    index = np.zeros((len(flat), 3), np.int64)
    index[:, : table.shape[1]] = table[:, :3]
    before = np.repeat(np.array(lines.counts, np.int64).reshape(-1, 3), sizes, axis=0)
    index = np.where(index < 0, before + index, index - 1)  # 1 is the first; -1 the last so far; 0 none
    limits = (vertices, len(lines.coordinates), len(lines.normals))
    if len(index) and (index[:, 0].min() < 0 or (index >= limits).any()):
        raise UserError("triangles refer to missing vertices; repair the file")
    index[index < 0] = NONE
    return sizes, index


def _materials_of(lines: Lines, owners: Integers) -> tuple[list[str], NDArray[np.int64]]:
    """Return the names of the materials, "" for none, and the index (F,) of each triangle's."""
    names = list(dict.fromkeys(["", *(name for _, name in lines.materials)]))
    places = {name: place for place, name in enumerate(names)}
    starts = np.array([0, *(start for start, _ in lines.materials)], np.int64)
    of_start = np.array([0, *(places[name] for _, name in lines.materials)], np.int64)
    return names, of_start[np.searchsorted(starts, owners, side="right") - 1]
