"""Shapes in a program's memory: meshes of trimesh, and arrays."""

import hashlib
from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...model.errors import UserError
from .cloud_files import Cloud
from .mesh_files import TexturedMesh, textured
from .shape import Doubles

Numbers = NDArray[np.floating] | NDArray[np.integer] | Sequence[Sequence[float]]
Arrays = trimesh.Trimesh | tuple[Numbers, Numbers] | tuple[Numbers, Numbers, Numbers]
"""A mesh of trimesh; vertices (V, 3) and faces (F, 3) of integers; or points (N, 3), normals (N, 3) and optionally
colors (N, 3) in [0, 1]."""


def content_of(arrays: Arrays) -> tuple[TexturedMesh | Cloud, str]:
    """Convert arrays to a mesh (its faces are integers) or a cloud. Returns it with a sha256. Raises UserError."""
    content = _content(arrays)
    hashed = (content.mesh.vertices, content.mesh.faces) if isinstance(content, TexturedMesh) else (content.points,)
    return content, hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in hashed)).hexdigest()


def _content(arrays: Arrays) -> TexturedMesh | Cloud:
    if isinstance(arrays, trimesh.Trimesh):
        return textured(arrays.copy(), None)
    if not isinstance(arrays, tuple) or len(arrays) not in (2, 3):
        raise UserError("a shape is a file, a trimesh.Trimesh, (vertices, faces), or (points, normals[, colors])")
    first, second, *rest = (np.asarray(array) for array in arrays)
    points = _rows(first)
    if not rest and np.issubdtype(second.dtype, np.integer):
        if second.ndim != 2 or second.shape[1] != 3 or not len(second):
            raise UserError(f"faces of shape {second.shape}; (F, 3) is needed")
        if second.min() < 0 or second.max() >= len(points):
            raise UserError("faces refer to missing vertices")
        return textured(trimesh.Trimesh(points, second, process=False), None)
    normals = _rows(second)
    colors = _rows(rest[0]) if rest else None
    if any(len(array) != len(points) for array in (normals, colors) if array is not None):
        raise UserError("points, normals and colors differ in number")
    return Cloud(points, normals, colors)


def _rows(array: NDArray[np.generic]) -> Doubles:
    """Convert an array (N, 3) to doubles. Raises UserError for another shape."""
    if array.ndim != 2 or array.shape[1] != 3:
        raise UserError(f"an array of shape {array.shape}; (N, 3) is needed")
    return np.asarray(array, np.float64)
