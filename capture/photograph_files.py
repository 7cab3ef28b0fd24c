"""The files and cameras of photographs, and how they are loaded."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..model.errors import UserError
from ..model.files import reason_of, regular, show
from ..model.image_file import open_image, opened_image
from ..model.orientation import upright
from ..model.references import Folder, UnresolvedError
from .cloud import Doubles
from .image_pixels import colors_of, mask_of, opaque
from .intrinsics import Intrinsics
from .photographs import Photograph

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
Loaded = dict[tuple[Path, Path | None], tuple[NDArray[np.uint8], NDArray[np.bool_] | None]]
"""Image and mask -> colors (H, W, 3) and mask (H, W)."""
SMALLEST = 8  # shortest side of a photograph, pixels
AGREED = 0.2
"""Least component, along an axis, of the mean of the photographs' up directions; otherwise the mean is useless."""
BOUND = 1e12
"""Largest number of a camera's matrix, and inverse of the shortest row of its first three columns."""
SINGULAR = 1e-9  # least determinant of a camera matrix with unit rows


@dataclass(frozen=True, eq=False)
class PhotographFile:
    """The files and the camera of one photograph."""

    image: Path
    mask: Path | None
    """None: use the image's transparency, if it has some."""
    size: tuple[int, int]
    """Width and height of the image, pixels."""
    projection: Doubles
    """(3, 4), from the cameras' space to pixels of the image, from its upper left corner."""


@dataclass(frozen=True, eq=False)
class Layout:
    """The content of a folder of photographs, and a ball around the object."""

    files: list[PhotographFile]
    ball: Doubles
    """(3,), center of the ball, cameras' space."""
    radius: float
    """Radius of the ball."""
    up: str
    """Axis of the cameras' space that points up."""
    warnings: list[str] = field(default_factory=list)

    @property
    def center(self) -> Doubles:
        """(3,), center of the ball in the cameras' space turned upright."""
        return upright(self.ball, self.up)

    @property
    def to_model(self) -> Doubles:
        """(4, 4), from model space to the cameras' space."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.radius * upright(np.eye(3), self.up), self.ball
        return matrix


def up_of(files: Sequence[PhotographFile], default: str) -> str:
    """Return the axis of the cameras' space nearest to the photographs' mean up direction.

    default: returned if the up directions cancel, for cameras in all orientations.
    """
    up = np.zeros(3)
    for file in files:
        rays = np.linalg.inv(file.projection[:, :3])
        in_picture = -rays[:, 1] * np.sign(np.linalg.det(rays))
        up += in_picture / np.linalg.norm(in_picture)
    axis = int(np.abs(up).argmax())
    if abs(up[axis]) < AGREED * len(files):
        return default
    return ("-" if up[axis] < 0 else "") + "xyz"[axis]


def natural(name: str) -> list[tuple[int, str]]:
    """Return the key that sorts names with their numbers, of any length, as numbers: 2.png comes before 10.png."""
    parts = [part.lstrip("0") if part.isdecimal() else part for part in re.split(r"(\d+)", name.lower()) if part]
    return [(len(part), part) if not part or part.isdecimal() else (-1, part) for part in parts]


def pictures_in(root: Folder, name: str) -> list[Path]:
    """List the pictures of a folder in `root`, by their numbers; hidden files are none. Raises UserError."""
    listed = (root.path / name).glob("*")
    names = [path for path in listed if path.suffix.lower() in SUFFIXES and not path.name.startswith(".")]
    found = [root.file(path.relative_to(root.path)) for path in names]
    return sorted(found, key=lambda path: natural(path.name))


def named_file(root: Folder, names: Sequence[str], label: str) -> Path:
    """Return the first file there is of those that a file of cameras may mean by a name, which is the last of `names`.

    label: of the place that names it. Raises UserError.
    """
    try:
        found = next(filter(None, map(root.find, names)), None)
    except UnresolvedError as error:
        raise UserError(f"{label}: {error}") from None
    if found is None:
        raise UserError(f"{label}: {show(names[-1][:80])}: no such file")
    return found


def mask_beside(root: Folder, name: str) -> Path | None:
    """Find the mask of a picture in masks/ or mask/: with its name, or with another ending, or with one more.

    Raises UserError for one that is elsewhere.
    """
    for place in ("masks", "mask"):
        path = Path(place, name)
        for other in (path, *(path.with_suffix(suffix) for suffix in SUFFIXES), Path(f"{path}.png")):
            if (found := root.find(other)) is not None:
                return found
    return None


def reach_of(size: tuple[int, int], camera: Intrinsics) -> float:
    """Return the sine of half of a camera's narrower angle of view. size: of the picture."""
    return math.sin(math.atan(min(size[0] / camera.fx, size[1] / camera.fy) / 2))


def ball_of(eyes: Doubles, axes: Doubles, reach: Doubles) -> Doubles:
    """Return center and radius (4,) of a ball that all cameras see, around the point nearest to their axes.

    eyes, axes: (N, 3). reach: (N,), of `reach_of`.
    """
    center = nearest_to_axes(eyes, axes)
    away = np.linalg.norm(eyes - center, axis=1)
    return np.append(center, max(float((away * reach).min()), 1e-9))


def nearest_to_axes(eyes: Doubles, axes: Doubles) -> Doubles:
    """Return the point (3,) nearest to all of the cameras' axes. eyes, axes: (N, 3)."""
    across = np.eye(3) - axes[:, :, None] * axes[:, None]
    found = np.linalg.lstsq(across.sum(axis=0), (across @ eyes[..., None]).sum(axis=0)[:, 0], rcond=None)[0]
    return np.asarray(found)


def size_of(path: Path) -> tuple[int, int]:
    """Return the width and height of an image. Raises UserError."""
    try:
        with opened_image(regular(path)) as opened:
            return opened.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise UserError(f"{show(path)}: {reason_of(error, 'not a readable image')}") from None


def check_projection(matrix: Doubles, name: str) -> Doubles:
    """Return a camera's projection (3, 4), its sign such that depths are positive. Raises UserError."""
    rows = matrix[:3, :4]
    if rows.shape != (3, 4) or not np.isfinite(rows).all():
        raise UserError(f"{name}: a camera is a matrix of 4 x 4 finite numbers")
    sizes = np.abs(rows)
    if sizes.max() > BOUND or 0 < sizes[:, :3].max(axis=1).min() < 1 / BOUND:
        raise UserError(f"{name}: the numbers of a camera are from {1 / BOUND:g} to {BOUND:g}")
    lengths = np.linalg.norm(rows[:, :3], axis=1)
    determinant = np.linalg.det(rows[:, :3] / np.maximum(lengths, 1e-300)[:, None])
    if abs(determinant) < SINGULAR:
        raise UserError(f"{name}: the camera's matrix is singular")
    return np.asarray(rows * np.sign(determinant))


def load_photograph(file: PhotographFile, scale: float, to_model: Doubles, loaded: Loaded) -> Photograph:
    """Load a photograph, shrink it, and convert its camera to model space. Raises UserError.

    loaded: what was loaded before at this scale, to which this is added: cameras may share an image.
    """
    key = file.image, file.mask
    if key not in loaded:
        loaded[key] = _pixels(file, scale)
    colors, mask = loaded[key]
    matrix = file.projection @ to_model
    inverse: Doubles = np.linalg.inv(matrix[:, :3]).astype(np.float64)
    pixels = np.diag([file.size[0] / colors.shape[1], file.size[1] / colors.shape[0], 1.0])
    return Photograph(file.image.name, colors, mask, -inverse @ matrix[:, 3], np.asarray(inverse @ pixels))


def _pixels(file: PhotographFile, scale: float) -> tuple[NDArray[np.uint8], NDArray[np.bool_] | None]:
    """Return the colors (H, W, 3) of a photograph and its mask (H, W), shrunk. Raises UserError."""
    picture = open_image(file.image, "photograph")
    width, height = (max(1, round(side * scale)) for side in file.size)
    if min(width, height) < SMALLEST:
        raise UserError(
            f"{show(file.image)}: {width} x {height} pixels after --scale; at least {SMALLEST} a side are needed"
        )
    mask = opaque(picture)
    if file.mask is not None:
        image = open_image(file.mask, "mask")
        if image.size != picture.size:
            raise UserError(
                f"{show(file.mask)}: {image.width} x {image.height}, its photograph {picture.width} x {picture.height}"
            )
        mask = mask_of(image)
    shrunk = picture.convert("RGB")
    if (width, height) != picture.size:
        shrunk = shrunk.resize((width, height), Image.Resampling.BOX)
        mask = None if mask is None else _shrunk(mask, (width, height))
    return colors_of(shrunk), mask


def _shrunk(mask: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.bool_]:
    picture = Image.fromarray(np.uint8(255) * mask.astype(np.uint8))
    return np.asarray(picture.resize(size, Image.Resampling.BOX)) >= 128
