"""Photographs as they were found in a folder, before they are read."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..model.errors import UserError
from ..model.files import show
from ..model.image_file import open_image
from .photograph import colours_of, masked, solid
from .posed import Doubles, Posed

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
LARGEST = 100e6
"""Pixels that all photographs have together, at most."""
SMALLEST = 8
"""Pixels that a side has, at least."""
AGREED = 0.2
"""Length of the mean of the pictures' directions upwards, along an axis, below which they tell nothing."""
SINGULAR = 1e-9
"""A camera's matrix with a smaller determinant, its rows being of length 1, gives no rays."""


@dataclass(frozen=True, eq=False)
class FoundView:
    """One photograph's files and its camera."""

    image: Path
    mask: Path | None
    """None: the picture's transparency, if it has some."""
    width: int
    """Of the picture, in pixels."""
    height: int
    projection: Doubles
    """(3, 4), from the cameras' space to pixels of the picture, from its upper left corner."""


@dataclass(frozen=True, eq=False)
class Found:
    """What a layout tells."""

    views: list[FoundView]
    centre: Doubles
    """(3,), of the ball that the object is in, in the cameras' space turned upright."""
    radius: float
    """Of that ball."""
    to_model: Doubles
    """(4, 4), from model space to the cameras' space."""
    up: str
    """Axis of the cameras' space that points up."""
    warnings: list[str] = field(default_factory=list)


def up_of(views: Sequence[FoundView], usual: str) -> str:
    """Return the axis of the cameras' space, as `upright` takes it, that is nearest to up in the pictures' mean.

    usual: the axis where the pictures' directions cancel, as where cameras are held every way.
    """
    up = np.zeros(3)
    for view in views:
        rays = np.linalg.inv(view.projection[:, :3])
        in_picture = -rays[:, 1] * np.sign(np.linalg.det(rays))
        up += in_picture / np.linalg.norm(in_picture)
    axis = int(np.abs(up).argmax())
    if abs(up[axis]) < AGREED * len(views):
        return usual
    return ("-" if up[axis] < 0 else "") + "xyz"[axis]


def size_of(path: Path) -> tuple[int, int]:
    """Return the width and height of a picture. Raises UserError where it cannot be read."""
    try:
        with Image.open(path) as opened:
            return opened.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else "not a readable image"
        raise UserError(f"{show(path)}: {reason}") from None


def check_projection(matrix: Doubles, name: str) -> Doubles:
    """Return a camera's projection (3, 4), its sign such that depths are positive. Raises UserError."""
    rows = matrix[:3, :4]
    if rows.shape != (3, 4) or not np.isfinite(rows).all():
        raise UserError(f"{name}: a camera is a matrix of 4 x 4 finite numbers")
    lengths = np.linalg.norm(rows[:, :3], axis=1)
    determinant = np.linalg.det(rows[:, :3] / np.maximum(lengths, 1e-300)[:, None])
    if abs(determinant) < SINGULAR:
        raise UserError(f"{name}: the camera's matrix is singular: no rays follow from it")
    return np.asarray(rows * np.sign(determinant))


def posed(view: FoundView, scale: float, to_model: Doubles) -> Posed:
    """Read a photograph, shrink it, and bring its camera into model space. Raises UserError."""
    name = show(view.image)
    picture = open_image(view.image, "photograph")
    size = (max(1, round(view.width * scale)), max(1, round(view.height * scale)))
    if min(size) < SMALLEST:
        raise UserError(f"{name}: {size[0]} x {size[1]} pixels after --scale; at least {SMALLEST} a side are needed")
    mask = solid(picture)
    if view.mask is not None:
        drawn = open_image(view.mask, "mask")
        if drawn.size != picture.size:
            raise UserError(
                f"{show(view.mask)}: {drawn.width} x {drawn.height}, its photograph {picture.width} x {picture.height}"
            )
        mask = masked(drawn)
    shrunk = picture.convert("RGB")
    if size != picture.size:
        shrunk = shrunk.resize(size, Image.Resampling.BOX)
        mask = None if mask is None else _shrunk(mask, size)
    matrix = view.projection @ to_model
    inverse: Doubles = np.linalg.inv(matrix[:, :3]).astype(np.float64)
    pixels = np.diag([view.width / size[0], view.height / size[1], 1.0])
    return Posed(view.image.name, colours_of(shrunk), mask, -inverse @ matrix[:, 3], np.asarray(inverse @ pixels))


def _shrunk(mask: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.bool_]:
    picture = Image.fromarray(np.uint8(255) * mask.astype(np.uint8))
    return np.asarray(picture.resize(size, Image.Resampling.BOX)) >= 128
