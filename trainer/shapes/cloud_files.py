"""Reads point clouds: text columns, NumPy arrays, the vertices of a PLY or an OBJ, and Gaussian splats."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ...model.errors import UserError
from .shape import Doubles

CONSTANT_HARMONIC = 0.28209479177387814
"""Value of the constant spherical harmonic, 1 / (2 sqrt(pi)): a splat's f_dc is a coefficient of it."""
FAINT = 0.3  # splats of lower opacity are left out
EMPTY = "the mesh is empty; a shape needs triangles or points"


@dataclass(frozen=True, eq=False)
class Cloud:
    """A point cloud in input space, as its file stores it."""

    points: Doubles
    """(N, 3)."""
    normals: Doubles | None
    """(N, 3), of any length; None if the file has none."""
    colors: Doubles | None
    """(N, 3), sRGB in [0, 1]; None if the file has none."""


def read_xyz(path: Path) -> Cloud:
    """Read text columns: x y z [nx ny nz] [r g b from 0 to 255]. Raises UserError."""
    table = np.loadtxt(path, ndmin=2, dtype=np.float64)
    if table.shape[1] not in (3, 6, 9):
        raise UserError(f"{table.shape[1]} columns; x y z [nx ny nz] [r g b] are needed")
    points, more = table[:, :3], [table[:, k : k + 3] for k in range(3, table.shape[1], 3)]
    # Normals have negative components, and are short; colors do not, and are not.
    colored = len(more) == 2 or (len(more) == 1 and more[0].min(initial=0) >= 0 and more[0].max(initial=0) > 2)
    return Cloud(points, None if len(more) == colored else more[0], more[-1] / 255 if colored else None)


def read_npz(path: Path) -> Cloud:
    """Read the array `points`, and optionally `normals` and `colors` (or `colors`) in [0, 1]. Raises UserError."""
    with np.load(path, allow_pickle=False) as arrays:
        if "points" not in arrays:
            raise UserError("the array `points` is missing")
        columns = {
            key: np.asarray(arrays[key], dtype=np.float64)
            for key in ("points", "normals", "colours", "colors")
            if key in arrays
        }
    for key, array in columns.items():
        if array.shape != (len(columns["points"]), 3):
            raise UserError(f"array `{key}` has shape {array.shape}, expected ({len(columns['points'])}, 3)")
    return Cloud(columns["points"], columns.get("normals"), columns.get("colors", columns.get("colours")))


def cloud_of_ply(columns: NDArray[Any] | Mapping[str, Any]) -> Cloud:
    """Convert the vertices of a PLY without faces, which may be Gaussian splats. Raises UserError.

    columns: by name, as trimesh stores them.
    """
    names = set((columns.dtype.names or ()) if isinstance(columns, np.ndarray) else columns)
    if not {"x", "y", "z"} <= names or not len(columns["x"]):
        raise UserError(EMPTY)

    def stack(*keys: str) -> Doubles | None:
        if not names.issuperset(keys):
            return None
        return np.stack([np.asarray(columns[key], dtype=np.float64).reshape(-1) for key in keys], axis=1)

    points, harmonics = stack("x", "y", "z"), stack("f_dc_0", "f_dc_1", "f_dc_2")
    assert points is not None
    if harmonics is not None:
        colors = np.clip(0.5 + CONSTANT_HARMONIC * harmonics, 0, 1)
        logits = stack("opacity")  # the file has the logit of the opacity
        solid = slice(None) if logits is None else logits[:, 0] >= np.log(FAINT / (1 - FAINT))
        return Cloud(points[solid], None, colors[solid])
    normals, rgb = stack("nx", "ny", "nz"), stack("red", "green", "blue")
    return Cloud(points, None if normals is None or not normals.any() else normals, None if rgb is None else rgb / 255)


def cloud_of_vertices(path: Path) -> Cloud:
    """Read the vertices of a mesh file without faces, and their colors. Raises UserError if there are none."""
    cloud: Any = trimesh.load(path, process=False)
    if not isinstance(cloud, trimesh.PointCloud) or not len(cloud.vertices):
        raise UserError(EMPTY)
    colors = np.asarray(cloud.colors, np.float64)
    colored = colors.shape[:1] == (len(cloud.vertices),) and colors.shape[1] >= 3
    return Cloud(np.asarray(cloud.vertices, np.float64), None, colors[:, :3] / 255 if colored else None)
