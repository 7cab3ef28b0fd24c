"""Which way is up, and where the front is: how a shape lies in its file, and how people want to see it first."""

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
"""Axis of a file that points up -> the rotation that turns it to model space's y axis, row by row.

Where z is up, a face that looks to -y, as modelling programs have it, looks to +z then.
"""
FILES_UP = {".glb": "y"}
"""Ending of a shape's file -> the axis that its format says is up (glTF 2.0, section 3.4). Others do not say."""
DEFAULT_UP = "y"


def upright(vectors: "NDArray[np.float64]", up: str) -> "NDArray[np.float64]":
    """Turn vectors (..., 3) of a file whose axis `up` points up so that y does."""
    import numpy as np

    return vectors if up == DEFAULT_UP else vectors @ np.array(UPRIGHT[up]).T


def as_in_file(vectors: "NDArray[np.float64]", up: str) -> "NDArray[np.float64]":
    """Turn vectors (..., 3) back from what `upright` made of them."""
    import numpy as np

    return vectors if up == DEFAULT_UP else vectors @ np.array(UPRIGHT[up])


def check_up(up: object) -> None:
    """Raise UserError where `up` is not the name of an axis."""
    if up not in UPRIGHT:
        raise UserError(f"up: {up!r} is none of {', '.join(UPRIGHT)}")


def check_front(front: object) -> None:
    """Raise UserError where `front` is not an azimuth and an elevation in degrees."""
    from .checks import check_finite  # loads numpy

    if not isinstance(front, (tuple, list)) or len(front) != 2:
        raise UserError("front: two numbers are needed, azimuth and elevation in degrees")
    for name, angle in zip(("azimuth", "elevation"), front, strict=True):
        check_finite(f"front: {name}", angle)
    if abs(front[0]) > 360 or abs(front[1]) > 90:
        raise UserError("front: azimuth from -360 to 360, elevation from -90 to 90 degrees")
