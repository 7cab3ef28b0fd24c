"""The layout of IDR and NeuS: image/, mask/ and cameras_sphere.npz."""

from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from ..model.files import show
from ..model.orientation import upright
from .intrinsics import of_one_shape
from .pictures import SUFFIXES, Found, FoundView, check_projection, size_of, up_of
from .posed import Doubles

OFF_CENTRE = 0.25
"""A principal point farther from the picture's middle, as a share of its sides, is of a picture of another size."""


def find_in_sphere(folder: Path, cameras: Path, camera_size: tuple[int, int] | None, up: str | None) -> Found:
    """Find the photographs of a folder. cameras: its world_mat_i project to pixels whose centres are whole numbers.

    camera_size: width and height of the pictures that the cameras are for; None: those of the pictures. The ball that
    the object is in is that of scale_mat_0. up: axis of the cameras' space that points up; None: y, or the one that
    points up in the pictures. Raises UserError.
    """
    images, masks = _pictures(folder / "image"), _pictures(folder / "mask")
    if not images:
        raise UserError(f"{show(folder / 'image')}: no pictures in it")
    if masks and len(masks) != len(images):
        raise UserError(f"{show(folder)}: {len(images)} pictures in image/ and {len(masks)} in mask/")
    matrices = _matrices(cameras)
    name = show(cameras)
    if "scale_mat_0" not in matrices:
        raise UserError(f"{name}: no scale_mat_0, which says where the object is")
    scale = matrices["scale_mat_0"]
    check_projection(scale, f"{name}, scale_mat_0")
    views = []
    for i, image in enumerate(images):
        key = f"world_mat_{i}"
        if key not in matrices:
            raise UserError(f"{show(image)}: no camera for it; {name} has no {key}")
        projection = check_projection(matrices[key], f"{name}, {key}")
        size = size_of(image)
        views.append(FoundView(image, masks[i] if masks else None, *size, _fitted(projection, size, camera_size, name)))
    up = up or up_of(views, "y")
    turned = np.eye(4)
    turned[:3, :3] = upright(np.eye(3), up)
    radius = abs(np.linalg.det(scale[:3, :3])) ** (1 / 3)
    to_model = np.eye(4)
    to_model[:3, :3], to_model[:3, 3] = radius * turned[:3, :3], scale[:3, 3]
    return Found(views, upright(scale[:3, 3], up), radius, to_model, up)


def _fitted(projection: Doubles, size: tuple[int, int], camera_size: tuple[int, int] | None, name: str) -> Doubles:
    """Make a projection one to pixels of a picture, from its corner. Raises UserError where it is for another size."""
    if camera_size is not None:
        if not of_one_shape(camera_size, size):
            width, height = camera_size
            raise UserError(f"--camera-size {width}x{height}: the pictures are {size[0]} x {size[1]}, of another shape")
    else:
        u, v = _principal_point(projection)
        if max(abs(u / size[0] - 0.5), abs(v / size[1] - 0.5)) > OFF_CENTRE:
            raise UserError(
                f"{name}: its cameras look at pixel {u:.0f}, {v:.0f}, the pictures are {size[0]} x {size[1]}; "
                "give the size that the cameras are for with --camera-size WxH"
            )
        camera_size = size
    across, down = size[0] / camera_size[0], size[1] / camera_size[1]
    to_corner = np.array([[across, 0, across / 2], [0, down, down / 2], [0, 0, 1]])
    return np.asarray(to_corner @ projection)


def _principal_point(projection: Doubles) -> tuple[float, float]:
    """Return where the camera's axis meets the picture, which is M m for the last row m of M."""
    axis = projection[:, :3] @ projection[2, :3]
    return float(axis[0] / axis[2]), float(axis[1] / axis[2])


def _pictures(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob("*") if path.suffix.lower() in SUFFIXES)


def _matrices(path: Path) -> dict[str, Doubles]:
    """Read the matrices of an NPZ file. Raises UserError where it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found: dict[str, Any] = {
                key: file[key] for key in file.files if key.startswith(("world_mat_", "scale_mat_"))
            }
            return {
                key: matrix.astype(np.float64)
                for key, matrix in found.items()
                if matrix.shape == (4, 4) and "inv" not in key and matrix.dtype.kind in "fiu"
            }
    except Exception:  # NumPy and zipfile raise anything on damaged files
        raise UserError(f"{show(path)}: not a readable NPZ file of cameras") from None
