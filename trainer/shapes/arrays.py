"""Shapes in a program's memory: meshes, clouds and scenes of trimesh, and arrays."""

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...model.errors import UserError
from ...readers import from_trimesh
from ...readers.clouds import cloud_of_table, content_of_arrays
from ...readers.content import Cloud, Mesh
from .shape import Doubles

Numbers = NDArray[np.floating] | NDArray[np.integer] | Sequence[Sequence[float]]
Arrays = (
    trimesh.Trimesh
    | trimesh.PointCloud
    | trimesh.Scene
    | NDArray[np.floating]
    | Mapping[str, Numbers]
    | tuple[Numbers]
    | tuple[Numbers, Numbers]
    | tuple[Numbers, Numbers, Numbers]
)
"""A mesh, point cloud or scene of trimesh; points (N, 3), or with more columns; vertices (V, 3) and faces (F, 3);
points (N, 3), normals (N, 3) and optionally colors (N, 3) in [0, 1], or bytes; arrays by name, as in an NPZ."""
KINDS = "a trimesh.Trimesh, PointCloud or Scene, (vertices, faces), points, or (points, normals[, colors])"


def content_of(arrays: Arrays, chosen: Sequence[str] | None = None) -> tuple[Mesh | Cloud, str]:
    """Convert arrays to a mesh or a cloud. Returns it with a sha256. Raises UserError.

    chosen: roles of the columns of a single array (`parse_columns`).
    """
    content = _content(arrays, chosen)
    hashed = (content.vertices, content.faces) if isinstance(content, Mesh) else (content.points,)
    return content, hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in hashed)).hexdigest()


def _content(arrays: Arrays, chosen: Sequence[str] | None) -> Mesh | Cloud:
    if isinstance(arrays, trimesh.Trimesh | trimesh.PointCloud | trimesh.Scene):
        return from_trimesh.content_of(arrays)
    if isinstance(arrays, Mapping):
        return content_of_arrays({str(name): np.asarray(array) for name, array in arrays.items()}, chosen)
    if isinstance(arrays, np.ndarray):
        arrays = (arrays,)
    if not isinstance(arrays, tuple) or len(arrays) not in (1, 2, 3):
        raise UserError(f"a shape is a file, {KINDS}")
    first, *rest = (np.asarray(array) for array in arrays)
    if not rest and first.ndim == 2 and first.shape[1] > 3:
        return cloud_of_table(first.astype(np.float64), chosen)
    points = _rows(first)
    if len(rest) == 1 and _are_faces(rest[0], len(points)):
        return content_of_arrays({"points": points, "faces": rest[0]})
    for array in rest:
        _rows(array)
    if any(len(array) != len(points) for array in rest):
        raise UserError("points, normals and colors differ in number")
    return content_of_arrays({"points": points, **dict(zip(("normals", "colors"), rest, strict=False))})


def _are_faces(array: NDArray[np.generic], vertices: int) -> bool:
    """Whether an array holds faces: whole numbers, also stored as floats, of vertices that exist."""
    if np.issubdtype(array.dtype, np.integer):
        return True
    if array.ndim != 2 or array.shape[1] != 3 or not len(array) or not np.issubdtype(array.dtype, np.floating):
        return False
    values = array.astype(np.float64)
    whole = bool((values == np.round(values)).all() and values.min() >= 0 and values.max() < vertices)
    return whole and bool(values.max() > 1)


def _rows(array: NDArray[np.generic]) -> Doubles:
    """Convert an array (N, 3) to doubles. Raises UserError for another shape."""
    if array.ndim != 2 or array.shape[1] != 3:
        raise UserError(f"an array of shape {array.shape}; (N, 3) is needed")
    return np.asarray(array, np.float64)
