"""The layout of COLMAP: images/ and a sparse model, as text or in binary."""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.errors import UserError
from ..model.files import show
from ..model.references import Folder
from .cloud import Doubles
from .intrinsics import UNFIT, Intrinsics, same_shape
from .photograph_files import (
    Layout,
    PhotographFile,
    ball_of,
    check_projection,
    mask_beside,
    named_file,
    natural,
    reach_of,
    size_of,
    up_of,
)

PLACES = ("sparse/0", "sparse", "colmap/sparse/0", "colmap/sparse", "0", ".")
"""Folders, beside the pictures, that may hold the sparse model."""
PICTURES = ("images", "input", "image", "rgb", ".")
MODELS = {
    0: ("SIMPLE_PINHOLE", 3, 1),
    1: ("PINHOLE", 4, 2),
    2: ("SIMPLE_RADIAL", 4, 1),
    3: ("RADIAL", 5, 1),
    4: ("OPENCV", 8, 2),
    5: ("OPENCV_FISHEYE", 8, 2),
    6: ("FULL_OPENCV", 12, 2),
    7: ("FOV", 5, 2),
    8: ("SIMPLE_RADIAL_FISHEYE", 4, 1),
    9: ("RADIAL_FISHEYE", 5, 1),
    10: ("THIN_PRISM_FISHEYE", 12, 2),
}
"""Number of a camera model -> its name, its numbers, and how many of them are focal lengths."""
STRAIGHT = {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"}
"""Models that are pinholes but for a distortion, which is ignored with a warning."""
NEGLIGIBLE = 1e-4  # smaller distortions cause no warning


@dataclass(frozen=True)
class Camera:
    """A camera of a sparse model."""

    width: int
    height: int
    pinhole: Intrinsics
    distorted: bool


@dataclass(frozen=True, eq=False)
class View:
    """A picture of a sparse model."""

    name: str
    camera: int
    quaternion: Doubles
    """(4,), w x y z, from the cameras' space to the camera's axes: x right, y down, z away."""
    translation: Doubles
    """(3,)."""


def sparse_model(root: Folder) -> Path | None:
    """Return the folder of a sparse model in a folder; None if there is none. Raises UserError for one elsewhere."""
    for place in PLACES:
        for ending in (".bin", ".txt"):
            if all(root.find(f"{place}/{name}{ending}") for name in ("cameras", "images")):
                return root.path / place
    return None


def find_in_colmap(root: Folder, sparse: Path, sphere: Doubles | None, up: str | None) -> Layout:
    """Find the photographs of a sparse model in a folder. sphere, up: of `find_in_transforms`. Raises UserError."""
    binary = (sparse / "images.bin").is_file() and (sparse / "cameras.bin").is_file()
    ending = ".bin" if binary else ".txt"
    try:
        cameras = dict((_binary_cameras if binary else _text_cameras)(sparse / f"cameras{ending}"))
        views = list((_binary_views if binary else _text_views)(sparse / f"images{ending}"))
    except (OSError, ValueError, IndexError, ArithmeticError, struct.error):
        raise UserError(f"{show(sparse)}: not a readable sparse model of COLMAP") from None
    files, eyes, axes, reach = [], [], [], []
    warnings: list[str] = []
    for view in sorted(views, key=lambda each: natural(each.name)):
        label = f"{show(sparse)}, {show(view.name)}"
        if view.camera not in cameras:
            raise UserError(f"{label}: camera {str(view.camera)[:20]} does not exist")
        camera = cameras[view.camera]
        if camera.distorted and not warnings:
            warnings.append(f"{label}: its lens distortion is ignored; undistort the pictures if it is large")
        image = _picture(root, view.name, label)
        size = size_of(image)
        if not same_shape((camera.width, camera.height), size):
            raise UserError(
                f"{label}: its camera is for a picture of {camera.width} x {camera.height}, this is "
                f"{size[0]} x {size[1]}"
            )
        pinhole = camera.pinhole.scaled(size[0] / camera.width, size[1] / camera.height)
        rotation = _rotation(view.quaternion)
        outside = np.concatenate((rotation, view.translation[:, None]), axis=1)
        matrix = np.array([[pinhole.fx, 0, pinhole.cx], [0, pinhole.fy, pinhole.cy], [0, 0, 1.0]])
        projection = check_projection(matrix @ outside, label)
        files.append(PhotographFile(image, mask_beside(root, view.name), size, projection))
        eyes.append(-rotation.T @ view.translation)
        axes.append(rotation[2])
        reach.append(reach_of(size, pinhole))
    if sphere is None:
        sphere = ball_of(np.array(eyes), np.array(axes), np.array(reach)) if files else np.array([0.0, 0.0, 0.0, 1.0])
    return Layout(files, sphere[:3], float(sphere[3]), up or up_of(files, "-y"), warnings)


def _picture(root: Folder, name: str, label: str) -> Path:
    """Find a picture in one of the folders for them. Raises UserError."""
    parts = [part for part in name.replace("\\", "/").split("/") if part not in ("", ".", "..")]
    return named_file(root, ["/".join((place, *parts)) for place in (*PICTURES, PICTURES[0])], label)


def _camera(model: str, width: int, height: int, numbers: list[float], focals: int) -> Camera:
    """Make a camera. Raises UserError for a lens that is no pinhole."""
    if model not in STRAIGHT:
        raise UserError(f"the camera model {show(model)[:40]} is not known; undistort the pictures to PINHOLE")
    fx, fy = numbers[0], numbers[focals - 1]
    cx, cy = numbers[focals], numbers[focals + 1]
    if not Intrinsics(fx, fy, cx, cy).fits(width, height):
        raise UserError(f"the camera {model}, {width} x {height}: {UNFIT}")
    distorted = any(abs(number) > NEGLIGIBLE for number in numbers[focals + 2 :])
    return Camera(width, height, Intrinsics(fx, fy, cx, cy), distorted)


def _text_cameras(path: Path) -> Iterator[tuple[int, Camera]]:
    focals = {name: count for name, _, count in MODELS.values()}
    for line in path.read_text("utf-8-sig").splitlines():
        words = line.split()
        if words and not words[0].startswith("#"):
            numbers = [float(word) for word in words[4:]]
            yield int(words[0]), _camera(words[1], int(words[2]), int(words[3]), numbers, focals.get(words[1], 1))


def _text_views(path: Path) -> Iterator[View]:
    for line in path.read_text("utf-8-sig").splitlines():
        words = line.split(None, 9)
        # After each picture comes a line with its points, numbers alone; some programs leave out empty ones.
        if len(words) == 10 and not line.startswith("#") and not _are_numbers(words[9]):
            numbers = np.array([float(word) for word in words[1:8]])
            yield View(words[9].strip(), int(words[8]), numbers[:4], numbers[4:])


def _are_numbers(text: str) -> bool:
    try:
        return all(map(math.isfinite, map(float, text.split())))
    except ValueError:
        return False


def _binary_cameras(path: Path) -> Iterator[tuple[int, Camera]]:
    data, at = path.read_bytes(), 8
    for _ in range(struct.unpack_from("<Q", data)[0]):
        number, model, width, height = struct.unpack_from("<iiQQ", data, at)
        at += 24
        name, count, focals = MODELS.get(model, (f"number {model}", 0, 1))
        numbers = list(struct.unpack_from(f"<{count}d", data, at))
        at += 8 * count
        yield number, _camera(name, width, height, numbers, focals)


def _binary_views(path: Path) -> Iterator[View]:
    data, at = path.read_bytes(), 8
    for _ in range(struct.unpack_from("<Q", data)[0]):
        numbers = struct.unpack_from("<i7di", data, at)
        at += struct.calcsize("<i7di")
        end = data.index(b"\0", at)
        name = data[at:end].decode("utf-8", errors="surrogateescape")
        at = end + 1
        at += 8 + 24 * int(struct.unpack_from("<Q", data, at)[0])
        yield View(name, numbers[8], np.array(numbers[1:5]), np.array(numbers[5:8]))


def _rotation(quaternion: Doubles) -> Doubles:
    """Return the matrix (3, 3) of a quaternion w x y z."""
    w, x, y, z = quaternion / max(float(np.linalg.norm(quaternion)), 1e-300)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
