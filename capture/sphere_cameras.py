"""The layout of IDR and NeuS: image/, mask/ and cameras_sphere.npz."""

from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import UserError
from ..model.files import show
from ..model.references import Folder
from .cloud import Doubles
from .intrinsics import same_shape
from .photograph_files import Layout, PhotographFile, check_projection, natural, pictures_in, size_of, up_of

LARGEST = 4096
"""Most bytes of a matrix of 4 x 4 numbers with its header."""
OFF_CENTER = 0.25
"""Largest distance of a principal point from the picture's center, as a share of its sides."""


def find_in_sphere(root: Folder, cameras: Path, camera_size: tuple[int, int] | None, up: str | None) -> Layout:
    """Find the photographs of a folder, which is `root`.

    cameras: its world_mat_i project to pixels whose centers are integers, and its scale_mat_0 is the ball around the
    object. camera_size: width and height that the cameras describe; None: the photographs' size. up: axis of the
    cameras' space that points up; None: as in the photographs, or y. Raises UserError.
    """
    folder = root.path
    images, masks = pictures_in(root, "image"), pictures_in(root, "mask")
    if not images:
        raise UserError(f"{show(folder / 'image')}: no pictures in it")
    if masks and len(masks) != len(images):
        raise UserError(f"{show(folder)}: {len(images)} pictures in image/ and {len(masks)} in mask/")
    named = {mask.stem: mask for mask in masks}
    if all(image.stem in named for image in images):
        masks = [named[image.stem] for image in images] if masks else []
    matrices = _matrices(cameras)
    name = show(cameras)
    if "scale_mat_0" not in matrices:
        raise UserError(f"{name}: scale_mat_0, the ball around the object, is missing")
    scale = matrices["scale_mat_0"]
    check_projection(scale, f"{name}, scale_mat_0")
    files = []
    warnings: list[str] = []
    cameras_there = sorted((key for key in matrices if key.startswith("world_mat_")), key=natural)
    # A picture that is missing leaves a gap in the names, which then are the numbers of the cameras.
    by_number = len(cameras_there) != len(images) and all(image.stem.isdecimal() for image in images)
    if len(cameras_there) > len(images) and not by_number:
        warnings.append(f"{name}: {len(cameras_there)} cameras for {len(images)} pictures; the first ones are taken")
    # Names from 1 are told by the last of them, which is the number of cameras.
    numbers = [int(image.stem) for image in images] if by_number else list(range(len(images)))
    base = int(by_number and min(numbers) > 0 and max(numbers) == len(cameras_there))
    if by_number:
        warnings.append(
            f"{name}: {len(cameras_there)} cameras for {len(images)} pictures; {show(images[0].name)} is taken with "
            f"world_mat_{numbers[0] - base}, and so on"
        )
    for i, image in enumerate(images):
        key = f"world_mat_{numbers[i] - base}"
        if key not in matrices:
            raise UserError(f"{show(image)}: no camera for it; {name} has no {key}")
        projection = check_projection(matrices[key], f"{name}, {key}")
        size = size_of(image)
        files.append(
            PhotographFile(image, masks[i] if masks else None, size, _resized(projection, size, camera_size, name))
        )
    radius = abs(np.linalg.det(scale[:3, :3])) ** (1 / 3)
    return Layout(files, scale[:3, 3], radius, up or up_of(files, "y"), warnings)


def _resized(projection: Doubles, size: tuple[int, int], camera_size: tuple[int, int] | None, name: str) -> Doubles:
    """Convert a projection to pixels of a photograph from its corner. Raises UserError if it has another size."""
    if camera_size is None:
        axis = projection[:, :3] @ projection[2, :3]  # the principal point is M m for the last row m of M
        u, v = float(axis[0] / axis[2]), float(axis[1] / axis[2])
        if max(abs(u / size[0] - 0.5), abs(v / size[1] - 0.5)) > OFF_CENTER:
            raise UserError(
                f"{name}: its cameras look at pixel {u:.0f}, {v:.0f}, the pictures are {size[0]} x {size[1]}; "
                "set the size that the cameras describe with --camera-size WxH"
            )
        camera_size = size
    elif not same_shape(camera_size, size):
        width, height = camera_size
        raise UserError(f"--camera-size {width}x{height}: the pictures are {size[0]} x {size[1]}, of another aspect")
    across, down = size[0] / camera_size[0], size[1] / camera_size[1]
    to_corner = np.array([[across, 0, across / 2], [0, down, down / 2], [0, 0, 1]])
    return np.asarray(to_corner @ projection)


def _matrices(path: Path) -> dict[str, Doubles]:
    """Read the matrices of an NPZ file. Raises UserError if it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            small = {entry.filename.removesuffix(".npy") for entry in file.zip.infolist() if entry.file_size <= LARGEST}
            found: dict[str, Any] = {
                key: file[key] for key in file.files if key.startswith(("world_mat_", "scale_mat_")) and key in small
            }
            return {
                key: matrix.astype(np.float64)
                for key, matrix in found.items()
                if matrix.shape == (4, 4) and "inv" not in key and matrix.dtype.kind in "fiu"
            }
    except Exception:  # NumPy and zipfile raise anything on damaged files
        raise UserError(f"{show(path)}: not a readable NPZ file of cameras") from None
