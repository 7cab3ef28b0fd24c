"""Shapes that a program has in memory: meshes of trimesh, and arrays."""

import hashlib
from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...model.errors import UserError
from .checks import check_cloud
from .load import TexturedMesh, shape_of_content, textured
from .points import Cloud
from .shape import Doubles, Shape

Numbers = NDArray[np.floating] | NDArray[np.integer] | Sequence[Sequence[float]]
Given = trimesh.Trimesh | tuple[Numbers, Numbers] | tuple[Numbers, Numbers, Numbers]
"""A mesh of trimesh; vertices (V, 3) and faces (F, 3) of whole numbers; or points (N, 3), normals (N, 3) and, where
there are any, colours (N, 3) in [0, 1]."""


def given_shape(
    given: Given,
    *,
    crease: float | None = None,
    noise: float | None = None,
    up: str,
    thicken: float | None = None,
    label: str = "arrays",
) -> tuple[Shape, list[str]]:
    """Make a shape of what a program has in memory, and return it with the warnings for the user.

    crease, noise, up, thicken: as of `load_shape`. label: the shape's name. Raises UserError where nothing can be
    learnt of it.
    """
    content = _content(given)
    try:
        if not isinstance(content, TexturedMesh):
            check_cloud(content.points, content.normals, content.colours)
    except UserError as error:
        raise UserError(f"{label}: {error}") from None
    arrays = (content.mesh.vertices, content.mesh.faces) if isinstance(content, TexturedMesh) else (content.points,)
    digest = hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays))
    return shape_of_content(
        content, label, {"sha256": digest.hexdigest()}, crease=crease, noise=noise, up=up, thicken=thicken
    )


def _content(given: Given) -> TexturedMesh | Cloud:
    """Tell meshes from clouds: faces are whole numbers. Raises UserError."""
    if isinstance(given, trimesh.Trimesh):
        return textured(given.copy(), None)
    if not isinstance(given, tuple) or len(given) not in (2, 3):
        raise UserError("a shape is a file, a trimesh.Trimesh, (vertices, faces), or (points, normals[, colours])")
    first, second, *rest = (np.asarray(array) for array in given)
    if not rest and np.issubdtype(second.dtype, np.integer):
        if second.ndim != 2 or second.shape[1] != 3 or not len(second):
            raise UserError(f"faces of shape {second.shape}; (F, 3) is needed")
        points = _rows(first)
        if second.min() < 0 or second.max() >= len(points):
            raise UserError("faces of vertices that are not there")
        return textured(trimesh.Trimesh(points, second, process=False), None)
    points, normals = _rows(first), _rows(second)
    colours = _rows(rest[0]) if rest else None
    if any(len(array) != len(points) for array in (normals, colours) if array is not None):
        raise UserError("points, normals and colours differ in number")
    return Cloud(points, normals, colours)


def _rows(array: NDArray[np.generic]) -> Doubles:
    """Return an array of shape (N, 3) as one of doubles. Raises UserError where it is none."""
    if array.ndim != 2 or array.shape[1] != 3:
        raise UserError(f"an array of shape {array.shape}; (N, 3) is needed")
    return np.asarray(array, np.float64)
