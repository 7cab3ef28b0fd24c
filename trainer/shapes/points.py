"""Point clouds as files have them: text columns, NumPy arrays, the points of a PLY or an OBJ, Gaussian splats."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from ...model.files import show
from .shape import Doubles

CONSTANT_HARMONIC = 0.28209479177387814
"""Value of the constant spherical harmonic, 1 / (2 sqrt(pi)): what a splat's f_dc is a multiple of."""
FAINT = 0.3
"""A splat of a lower opacity is no part of the surface."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """A point cloud as it was read."""

    points: Doubles
    """(N, 3), input space."""
    normals: Doubles | None
    """(N, 3), of any length; None where the file has none."""
    colours: Doubles | None
    """(N, 3), sRGB in [0, 1]; None where the file has none."""


def no_image(image: Path | None) -> None:
    """Raise UserError where an image is given for a point cloud."""
    if image is not None:
        raise UserError(f"--texture {show(image)}: points have no texture coordinates to put an image by")


def read_xyz(path: Path, image: Path | None) -> Cloud:
    """Read text columns: x y z, then nx ny nz, then r g b from 0 to 255, each of the two or none. Raises UserError."""
    no_image(image)
    table = np.loadtxt(path, ndmin=2, dtype=np.float64)
    if table.shape[1] not in (3, 6, 9):
        raise UserError(f"{table.shape[1]} columns; x y z [nx ny nz] [r g b] are needed")
    points, more = table[:, :3], [table[:, k : k + 3] for k in range(3, table.shape[1], 3)]
    # Normals of a surface look to all sides, and are short; colours do not, and are not.
    coloured = len(more) == 2 or (len(more) == 1 and more[0].min(initial=0) >= 0 and more[0].max(initial=0) > 2)
    return Cloud(points, None if len(more) == coloured else more[0], more[-1] / 255 if coloured else None)


def read_npz(path: Path, image: Path | None) -> Cloud:
    """Read the arrays `points`, and where they are there `normals` and `colours` in [0, 1]. Raises UserError."""
    no_image(image)
    with np.load(path, allow_pickle=False) as arrays:
        if "points" not in arrays:
            raise UserError("no array `points` in it")
        known = [key for key in ("points", "normals", "colours") if key in arrays]
        columns = {key: np.asarray(arrays[key], dtype=np.float64) for key in known}
    for key, array in columns.items():
        if array.shape != (len(columns["points"]), 3):
            raise UserError(f"array `{key}` has shape {array.shape}, expected ({len(columns['points'])}, 3)")
    return Cloud(columns["points"], columns.get("normals"), columns.get("colours"))


def points_of_ply(columns: NDArray[Any] | Mapping[str, Any]) -> Cloud:
    """Make a cloud of the vertices of a PLY without faces, which may be Gaussian splats. Raises UserError.

    columns: by name, as trimesh has them.
    """
    names = set((columns.dtype.names or ()) if isinstance(columns, np.ndarray) else columns)
    if not {"x", "y", "z"} <= names or not len(columns["x"]):
        raise UserError("the mesh is empty; a shape needs triangles or points")

    def stack(*keys: str) -> Doubles:
        return np.stack([np.asarray(columns[key], dtype=np.float64).reshape(-1) for key in keys], axis=1)

    points, colours = stack("x", "y", "z"), None
    if {"red", "green", "blue"} <= names:
        colours = stack("red", "green", "blue") / 255
    if {"f_dc_0", "f_dc_1", "f_dc_2"} <= names:
        colours = np.clip(0.5 + CONSTANT_HARMONIC * stack("f_dc_0", "f_dc_1", "f_dc_2"), 0, 1)
        if "opacity" in names:  # as it is trained, the logit of what is between 0 and 1
            seen = stack("opacity")[:, 0] >= np.log(FAINT / (1 - FAINT))
            return Cloud(points[seen], None, colours[seen])
        return Cloud(points, None, colours)
    normals = stack("nx", "ny", "nz") if {"nx", "ny", "nz"} <= names else None
    return Cloud(points, None if normals is None or not normals.any() else normals, colours)
