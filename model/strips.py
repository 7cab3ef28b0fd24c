"""Triangle strips of a PLY: old scans of Stanford and Cyberware have them instead of faces."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import trimesh


def mesh_of_strips(loaded: Any) -> "trimesh.Trimesh | None":
    """Convert the triangle strips of a PLY to a mesh; None without strips.

    loaded: trimesh's point cloud of the PLY. Each triangle of a strip shares two vertices with the previous one; a
    negative number starts a new strip.
    """
    import trimesh

    raw = loaded.metadata.get("_ply_raw", {})
    strips = [strip for row in _rows(raw.get("tristrips", {}).get("data")) for strip in _parted(row)]
    if not strips:
        return None
    faces = trimesh.util.triangle_strips_to_faces(strips)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]  # Strips repeat a vertex to change direction.
    columns = raw["vertex"]["data"]
    names = set(columns.dtype.names if isinstance(columns, np.ndarray) else columns)

    def stack(*keys: str) -> NDArray[Any] | None:
        return np.stack([np.asarray(columns[key]).reshape(-1) for key in keys], axis=1) if names >= set(keys) else None

    return trimesh.Trimesh(
        stack("x", "y", "z"),
        faces,
        vertex_normals=stack("nx", "ny", "nz"),
        vertex_colors=stack("red", "green", "blue"),
        process=False,
    )


def _rows(data: Any) -> list[NDArray[np.int64]]:
    """Return the lists of an element with a single list property, from trimesh's data of an ASCII or binary file."""
    if data is None:
        return []
    names = data.dtype.names if isinstance(data, np.ndarray) else list(data)
    column = data[names[0]]
    if getattr(column, "dtype", None) is not None and column.dtype.names:
        column = column[column.dtype.names[-1]]  # The first field is the length.
    return [np.asarray(row, np.int64).ravel() for row in column]


def _parted(row: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Split a list at negative numbers into strips of at least three vertices."""
    ends = np.flatnonzero(row < 0)
    return [strip[strip >= 0] for strip in np.split(row, ends) if (strip >= 0).sum() >= 3]
