"""Triangle strips of a PLY, which old scans of Stanford and Cyberware have in place of faces."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import trimesh


def mesh_of_strips(loaded: Any) -> "trimesh.Trimesh | None":
    """Make the mesh of a PLY's triangle strips; None where it has none.

    loaded: what trimesh has read, for which a PLY without faces is a cloud. In a strip each triangle shares the last
    two vertices of the one before it, and a negative number begins a new strip.
    """
    import trimesh

    raw = loaded.metadata.get("_ply_raw", {})
    strips = [strip for row in _rows(raw.get("tristrips", {}).get("data")) for strip in _parted(row)]
    if not strips:
        return None
    faces = trimesh.util.triangle_strips_to_faces(strips)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]  # A vertex that is repeated turns a strip round.
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
    """Return the lists of an element whose one property is a list, as trimesh keeps them from a text or from bytes."""
    if data is None:
        return []
    names = data.dtype.names if isinstance(data, np.ndarray) else list(data)
    column = data[names[0]]
    if getattr(column, "dtype", None) is not None and column.dtype.names:
        column = column[column.dtype.names[-1]]  # The first is the length.
    return [np.asarray(row, np.int64).ravel() for row in column]


def _parted(row: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Part a list at its negative numbers into strips of three vertices and more."""
    ends = np.flatnonzero(row < 0)
    return [strip[strip >= 0] for strip in np.split(row, ends) if (strip >= 0).sum() >= 3]
