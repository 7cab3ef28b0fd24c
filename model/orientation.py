"""The up axis and the front of a shape, in the coordinates of its file."""

from typing import TYPE_CHECKING

from .errors import UserError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

UPRIGHT = {
    "y": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "z": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    "x": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "-y": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
    "-z": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "-x": ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
}
"""Up axis of a file -> rows of the rotation that maps it to model space's y axis.

With z up, as in modeling programs, the front -y becomes +z.
"""
FILES_UP = {".glb": "y", ".gltf": "y"}
"""Suffix of a file -> up axis that its format prescribes (glTF 2.0, section 3.4)."""
DEFAULT_UP = "y"


def upright(vectors: "NDArray[np.float64]", up: str) -> "NDArray[np.float64]":
    """Rotate vectors (..., 3) from a file with the up axis `up` to y up."""
    import numpy as np

    return vectors if up == DEFAULT_UP else vectors @ np.array(UPRIGHT[up]).T


def as_in_file(vectors: "NDArray[np.float64]", up: str) -> "NDArray[np.float64]":
    """Rotate vectors (..., 3) back: the inverse of `upright`."""
    import numpy as np

    return vectors if up == DEFAULT_UP else vectors @ np.array(UPRIGHT[up])


def check_up(up: object) -> None:
    """Raise UserError if `up` is not the name of an axis."""
    if up not in UPRIGHT:
        raise UserError(f"up: {up!r} is none of {', '.join(UPRIGHT)}")


def check_front(front: object) -> None:
    """Raise UserError if `front` is not an azimuth and an elevation in degrees."""
    from .checks import check_finite  # loads numpy

    if not isinstance(front, (tuple, list)) or len(front) != 2:
        raise UserError("front: two numbers are needed, azimuth and elevation in degrees")
    for name, angle in zip(("azimuth", "elevation"), front, strict=True):
        check_finite(f"front: {name}", angle)
    if abs(front[0]) > 360 or abs(front[1]) > 90:
        raise UserError("front: azimuth from -360 to 360, elevation from -90 to 90 degrees")
