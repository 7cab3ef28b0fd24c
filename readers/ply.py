"""Reads PLY files: meshes of polygons or of triangle strips, point clouds, and Gaussian splats."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from ..model.references import Folder, UnresolvedError
from .claims import Claims
from .clouds import EMPTY, cloud_of_columns
from .column_names import NAMES, QUIET, plain, roles_of
from .columns import stacked, typed_colors
from .content import Cloud, Facts, Mesh
from .images import Images, Missing, users_picture
from .named_files import NamedFiles
from .paint import Material, Paint, Picture
from .ply_file import Element, Lists, Ply, read_elements
from .polygons import triangulated
from .values import CornerValues, Doubles, Integers

INDICES = ("vertex_indices", "vertex_index", "vertex_indexes", "indices")
"""Names of a face's list of vertices."""
KNOWN = {"flags", "quality", "texnumber", "intensity", "confidence", "group_id", "smoothing_group", "materialindex"}
"""Columns of faces and vertices of a mesh that carry neither shape nor color."""


def read_ply(path: Path, image: Path | None, chosen: Sequence[str] | None = None, follow: bool = False) -> Mesh | Cloud:
    """Read a PLY file; without faces or strips, its vertices are a cloud. Raises UserError.

    image: replaces the file's. chosen: roles of a cloud's columns. follow: of `Folder`, for the names of images.
    """
    folder = Folder(path.parent, follow)
    ply = read_elements(path)
    vertex = ply.elements.get("vertex")
    if vertex is None or not vertex.count:
        raise UserError(EMPTY)
    if "packed_position" in vertex.columns:
        raise UserError("compressed Gaussian splats (PlayCanvas); save them as an uncompressed PLY")
    faces = next((ply.elements[name] for name in ("face", "faces") if name in ply.elements), None)
    strips = ply.elements.get("tristrips")
    corners = next((faces.lists[name] for name in INDICES if name in faces.lists), None) if faces else None
    if corners is not None and (corners.sizes >= 3).any():
        assert faces is not None
        triangles, owners = triangulated(_points(vertex), corners.sizes, _checked(corners.values, vertex.count))
        return _mesh(folder, ply, vertex, corners.values[triangles].astype(np.int64), (faces, triangles, owners), image)
    if strips is not None and strips.lists:
        found = of_strips(next(iter(strips.lists.values())))
        if len(found):
            _checked(found, vertex.count)
            return _mesh(folder, ply, vertex, found, None, image)
    if faces is not None and faces.lists and corners is None:
        raise UserError(f"faces without a list of vertices; it has {', '.join(map(show, [*faces.lists][:8]))}")
    return cloud_of_columns(list(vertex.columns), list(vertex.columns.values()), chosen)


def of_strips(lists: Lists) -> Integers:
    """Convert triangle strips to triangles (F, 3). Old scans have strips instead of faces.

    Each triangle of a strip shares two vertices with the previous one; a negative number starts a new strip.
    """
    values = lists.values.astype(np.int64)
    strips = np.cumsum(values < 0) + np.repeat(np.arange(len(lists.sizes)), lists.sizes)
    values, strips = values[values >= 0], strips[values >= 0]
    joined = np.stack((values[:-2], values[1:-1], values[2:]), axis=1)
    odd = (np.arange(len(values)) - np.searchsorted(strips, strips))[:-2] % 2 == 1
    joined[odd] = joined[odd][:, [1, 0, 2]]
    joined = joined[strips[:-2] == strips[2:]]
    return np.asarray(joined[(joined != np.roll(joined, 1, axis=1)).all(axis=1)])  # repeated vertices turn a strip


def _points(vertex: Element) -> Doubles:
    names, columns = list(vertex.columns), list(vertex.columns.values())
    points = stacked(columns, roles_of(names), "x y z")
    if points is None:
        raise UserError(f"no columns x, y, z; it has {', '.join(map(show, names))}")
    return points.astype(np.float64)


def _checked(index: NDArray[Any], count: int) -> NDArray[Any]:
    """Return indices of vertices. Raises UserError for those that do not exist."""
    if len(index) and (index.min() < 0 or index.max() >= count):
        raise UserError("triangles refer to missing vertices; repair the file")
    return index.astype(np.int64)


def _mesh(
    folder: Folder,
    ply: Ply,
    vertex: Element,
    faces: Integers,
    polygons: tuple[Element, Integers, Integers] | None,
    image: Path | None,
) -> Mesh:
    """Make a mesh. polygons: the element of the faces, each triangle's corners in its lists, and its face."""
    names, columns = list(vertex.columns), list(vertex.columns.values())
    roles, facts = roles_of(names), Facts()
    normals, rgb = stacked(columns, roles, "nx ny nz"), stacked(columns, roles, "r g b")
    uv = stacked(columns, roles, "u v")
    coordinates = None if uv is None else CornerValues(uv.astype(np.float64), faces)
    colors = None if rgb is None else CornerValues(typed_colors(rgb), faces)
    if polygons is not None:
        coordinates = _wedges(*polygons) or coordinates
        colors = colors or _face_colors(polygons[0], polygons[2])
    used = set(roles.values())
    left = [name for place, name in enumerate(names) if place not in used and plain(name) not in QUIET | KNOWN]
    if left:
        facts.warnings.append(f"columns that are not used: {', '.join(map(show, left[:8]))}")
    facts.unwrapped = coordinates is not None
    pictures, missing = _pictures(folder, ply.comments, coordinates, image)
    if not pictures and coordinates is not None and colors is None:
        facts.warnings.append(missing.line())
    paint, material = None, np.zeros(len(faces), np.int64)
    if pictures:
        if polygons is not None and len(pictures) > 1 and "texnumber" in polygons[0].columns:
            material = np.clip(polygons[0].columns["texnumber"][polygons[2]].astype(np.int64), 0, len(pictures) - 1)
        paint = Paint(tuple(map(Material, pictures)), material, coordinates)
    elif colors is not None:
        paint = Paint((Material(),), material, colors=colors)
    points = _points(vertex)
    given = None if normals is None or not normals.any() else CornerValues(normals.astype(np.float64), faces)
    return Mesh(points, faces, given, paint, facts)


def _pictures(
    folder: Folder, comments: list[str], coordinates: CornerValues | None, image: Path | None
) -> tuple[list[Picture], Missing]:
    """Load the image that the user names, or those of the comments. Returns them, and the first one that is missing.

    Where one is missing, none is used.
    """
    if image is not None:
        return [users_picture(image, unwrapped=coordinates is not None)], Missing("")
    if coordinates is None:
        return [], Missing("")
    files, images = NamedFiles(folder), Images(Claims(0))
    try:
        named = [text.split(None, 1)[1].strip() for text in comments if text.lower().startswith("texturefile ")]
        return [images.named(files, name) for name in named], Missing("")
    except UnresolvedError as error:
        return [], Missing(error.name, error.why)


def _wedges(faces: Element, triangles: Integers, owners: Integers) -> CornerValues | None:
    """Return the texture coordinates that faces store for their corners; None without them."""
    lists = faces.lists.get("texcoord")
    corners = next(faces.lists[name] for name in INDICES if name in faces.lists)
    if lists is None or not len(lists.values) or (lists.sizes != 2 * corners.sizes).any():
        return None
    return CornerValues(lists.values.astype(np.float64).reshape(-1, 2), triangles)


def _face_colors(faces: Element, owners: Integers) -> CornerValues | None:
    """Return the colors of faces, at all of their corners; None without them."""
    names, columns = list(faces.columns), list(faces.columns.values())
    roles: Mapping[str, int] = {
        role: place for role, place in roles_of(names).items() if NAMES.get(plain(names[place]))
    }
    rgb = stacked(columns, roles, "r g b")
    if rgb is None:
        return None
    return CornerValues(typed_colors(rgb), np.repeat(owners[:, None], 3, axis=1))
