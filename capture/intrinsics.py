"""The pinhole camera that took a picture, from a field of view, from a file, or from the picture's own notes."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..model.errors import UserError
from ..model.files import show

FOCAL_LENGTH_35MM = 0xA405
"""EXIF's FocalLengthIn35mmFilm."""
EXIF_IFD = 0x8769
"""Where EXIF keeps it."""
FILM_DIAGONAL = math.hypot(36, 24)
"""Of 35 mm film, in millimetres: the focal length is given for a picture of the same diagonal."""
SAME_ASPECT = 0.02
"""By this share the aspects of two pictures of one view may differ: sizes are rounded to whole pixels."""


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion; lengths are in pixels, from the picture's upper left corner."""

    fx: float
    """Focal length across."""
    fy: float
    """Focal length down."""
    cx: float
    """Where the optical axis meets the picture: from the left."""
    cy: float
    """The same from the top."""

    def plane(self, height: int, width: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return where the rays through the pixels' centres meet the plane at distance 1: x (width,), y (height,).

        x points right and y down.
        """
        x = (np.arange(width, dtype=np.float64) + 0.5 - self.cx) / self.fx
        return x, (np.arange(height, dtype=np.float64) + 0.5 - self.cy) / self.fy


def of_one_shape(size: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two sizes (width, height) are those of pictures of one view."""
    return abs(size[0] / size[1] * other[1] / other[0] - 1) <= SAME_ASPECT


def of_view(fov: float, height: int, width: int) -> Intrinsics:
    """Return the camera with a vertical field of view, in degrees, whose axis meets the middle of the picture.

    Raises UserError where the angle is not between 1 and 150 degrees, which are the viewer's bounds.
    """
    if not 1 <= fov <= 150:
        raise UserError(f"--fov {fov:g}: between 1 and 150 degrees")
    focal = height / 2 / math.tan(math.radians(fov) / 2)
    return Intrinsics(focal, focal, width / 2, height / 2)


def of_photograph(image: Path, height: int, width: int) -> Intrinsics | None:
    """Return the camera by the focal length that a photograph notes in its EXIF; None where it notes none."""
    try:
        with Image.open(image) as opened:
            millimetres = opened.getexif().get_ifd(EXIF_IFD).get(FOCAL_LENGTH_35MM)
    except (OSError, ValueError, SyntaxError):
        return None
    if not isinstance(millimetres, int | float) or not 1 <= millimetres <= 5000:
        return None
    focal = float(millimetres) / FILM_DIAGONAL * math.hypot(width, height)
    return Intrinsics(focal, focal, width / 2, height / 2)


def of_file(path: Path, height: int, width: int) -> Intrinsics:
    """Read a camera from a JSON file.

    It holds one of: numbers fx, fy, cx, cy; numbers fl_x, fl_y, cx, cy (nerfstudio); a matrix K, three rows of three;
    intrinsic_matrix, nine numbers column by column (Open3D). Where it tells the picture's own size, as width and
    height or w and h, the camera is scaled to that of the depth map. Raises UserError, one line that names the file.
    """
    name = show(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{name}: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        raise UserError(f"{name}: no JSON; it should hold fx, fy, cx, cy") from None
    if not isinstance(content, dict):
        raise UserError(f"{name}: a JSON object with fx, fy, cx, cy is needed")
    try:
        camera = _of_json(content)
        size = [float(content[key]) for key in _size_keys(content)]
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        key = f" ({error.args[0]} is missing)" if isinstance(error, KeyError) else ""
        raise UserError(f"{name}: numbers fx, fy, cx, cy, or a 3 x 3 matrix K, are needed{key}") from None
    if (
        not all(map(math.isfinite, (camera.fx, camera.fy, camera.cx, camera.cy, *size)))
        or min(camera.fx, camera.fy) <= 0
    ):
        raise UserError(f"{name}: the focal lengths must be above 0, and all numbers finite")
    if not size:
        return camera
    if min(size) <= 0 or not of_one_shape((size[0], size[1]), (width, height)):
        raise UserError(
            f"{name}: the camera's picture is {size[0]:g} x {size[1]:g}, the depth map {width} x {height}; "
            "these are not of one shape"
        )
    across, down = width / size[0], height / size[1]
    return replace(camera, fx=camera.fx * across, cx=camera.cx * across, fy=camera.fy * down, cy=camera.cy * down)


def _of_json(content: Mapping[str, Any]) -> Intrinsics:
    """Read the four numbers. Raises KeyError, TypeError or ValueError where they are not there."""
    if "K" in content or "intrinsic_matrix" in content:
        matrix = np.array(content["K"] if "K" in content else content["intrinsic_matrix"], np.float64)
        if matrix.shape == (9,):
            matrix = matrix.reshape(3, 3) if "K" in content else matrix.reshape(3, 3).T
        if matrix.shape != (3, 3):
            raise ValueError
        return Intrinsics(float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2]))
    names = ("fl_x", "fl_y", "cx", "cy") if "fl_x" in content else ("fx", "fy", "cx", "cy")
    fx, fy, cx, cy = (float(content[name]) for name in names)
    return Intrinsics(fx, fy, cx, cy)


def _size_keys(content: Mapping[str, Any]) -> tuple[str, ...]:
    return next((keys for keys in (("width", "height"), ("w", "h")) if all(key in content for key in keys)), ())
