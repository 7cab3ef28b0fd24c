"""Pinhole cameras: from a field of view, from a file, or from a photograph's EXIF."""

import json
import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from ..model.files import regular, show
from ..model.image_file import opened_image
from .cloud import Doubles

EXIF_IFD, FOCAL_LENGTH_35MM = 0x8769, 0xA405  # EXIF's directory of camera settings, and its tag FocalLengthIn35mmFilm
FILM_DIAGONAL = math.hypot(36, 24)
"""Diagonal of 35 mm film, millimeters; the focal length refers to a picture of the same diagonal."""
FAR_OFF = 1e4
"""Largest ratio of a focal length, or of the optical axis's position, to the longer side of a picture, or of the side
to the focal length."""
UNFIT = "the focal lengths must be above 0, and no number of a camera far beyond the picture's sides"
"""Message for a camera that does not fit."""
SAME_ASPECT = 0.02
"""Largest relative difference of the aspects of two pictures of one view: sizes are rounded to whole pixels."""


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion; lengths are in pixels from the picture's upper left corner."""

    fx: float
    """Horizontal focal length."""
    fy: float
    """Vertical focal length."""
    cx: float
    """Horizontal position of the optical axis."""
    cy: float
    """Vertical position of the optical axis."""

    def plane(self, height: int, width: int) -> tuple[Doubles, Doubles]:
        """Return the coordinates x (width,), y (height,) of the pixels' rays in the plane at distance 1.

        x points right, y down.
        """
        x = (np.arange(width, dtype=np.float64) + 0.5 - self.cx) / self.fx
        return x, (np.arange(height, dtype=np.float64) + 0.5 - self.cy) / self.fy

    def fits(self, width: float, height: float) -> bool:
        """Whether the camera can have taken a picture of this size, in pixels. NaN and infinity do not fit."""
        short, long = sorted((width, height))
        if not 0 < short <= long < math.inf or not min(self.fx, self.fy) >= long / FAR_OFF:
            return False
        return all(abs(number) <= FAR_OFF * long for number in astuple(self))

    def scaled(self, across: float, down: float) -> "Intrinsics":
        """Return the camera of the resized picture."""
        return Intrinsics(self.fx * across, self.fy * down, self.cx * across, self.cy * down)


def same_shape(size: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two sizes (width, height) have the same aspect."""
    return abs(size[0] / size[1] * other[1] / other[0] - 1) <= SAME_ASPECT


def of_view(fov: float, height: int, width: int) -> Intrinsics:
    """Return the camera with a vertical field of view, degrees, whose axis meets the center of the picture."""
    focal = height / 2 / math.tan(math.radians(fov) / 2)
    return Intrinsics(focal, focal, width / 2, height / 2)


def of_photograph(image: Path, height: int, width: int) -> Intrinsics | None:
    """Return the camera for the focal length in a photograph's EXIF; None without one."""
    try:
        with opened_image(image) as opened:
            millimeters = opened.getexif().get_ifd(EXIF_IFD).get(FOCAL_LENGTH_35MM)
    except (OSError, ValueError, SyntaxError):
        return None
    if not isinstance(millimeters, int | float) or not 1 <= millimeters <= 5000:
        return None
    focal = float(millimeters) / FILM_DIAGONAL * math.hypot(width, height)
    return Intrinsics(focal, focal, width / 2, height / 2)


def of_file(path: Path, height: int, width: int) -> Intrinsics:
    """Read a camera from a JSON file, and scale it to a depth map's size if the file has the picture's own size.

    The file has one of: fx, fy, cx, cy; fl_x, fl_y, cx, cy (nerfstudio); K, three rows of three numbers;
    intrinsic_matrix, nine numbers column by column (Open3D). Its size is width and height, or w and h. Raises UserError
    with the file's name.
    """
    name = show(path)
    try:
        content = json.loads(regular(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UserError(f"{name}: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        raise UserError(f"{name}: not JSON; fx, fy, cx, cy are needed") from None
    if not isinstance(content, dict):
        raise UserError(f"{name}: a JSON object with fx, fy, cx, cy is needed")
    try:
        camera = _of_json(content)
        size = [float(content[key]) for key in _size_keys(content)]
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        key = f" ({error.args[0]} is missing)" if isinstance(error, KeyError) else ""
        raise UserError(f"{name}: numbers fx, fy, cx, cy, or a 3 x 3 matrix K, are needed{key}") from None
    if not camera.fits(*(size or (width, height))):
        raise UserError(f"{name}: {UNFIT}")
    if not size:
        return camera
    if not same_shape((size[0], size[1]), (width, height)):
        raise UserError(
            f"{name}: the camera's picture is {size[0]:g} x {size[1]:g}, the depth map {width} x {height}; "
            "the aspects differ"
        )
    return camera.scaled(width / size[0], height / size[1])


def _of_json(content: Mapping[str, Any]) -> Intrinsics:
    """Read the four numbers. Raises KeyError, TypeError or ValueError if they are missing."""
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
