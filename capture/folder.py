"""Loads a folder of photographs in any of the layouts."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..model.errors import UserError
from ..model.files import is_folder, show
from ..model.references import Folder
from .colmap import find_in_colmap, sparse_model
from .photograph_files import Layout, Loaded, load_photograph
from .photographs import Photographs
from .sphere_cameras import find_in_sphere
from .transforms import TRANSFORMS, find_in_transforms

CAMERAS = ("cameras_sphere.npz", "cameras.npz")
"""Names of the file of cameras in the layout of IDR and NeuS."""
FEWEST = 3  # fewest photographs that determine a shape
PIXELS, MOST_PIXELS = 4e6, 100e6  # number of pixels of all photographs without --scale, and the largest number with it


def read_photographs(
    folder: Path,
    scale: float | None = None,
    camera_size: tuple[int, int] | None = None,
    sphere: tuple[float, float, float, float] | None = None,
    up: str | None = None,
    *,
    follow: bool = False,
) -> tuple[Photographs, list[str]]:
    """Load the photographs of a folder and their cameras: of IDR and NeuS, with a transforms.json, or of COLMAP.

    scale: factor on the photographs' sides, at most 1; None: shrink to `PIXELS`. camera_size: width and height that
    cameras_sphere.npz describes; None: the photographs' size. sphere: center and radius of a ball around the object,
    for a transforms.json. up: axis of the cameras' space that points up; None: as in the photographs. follow: of
    `Folder`, for all files in the folder and those that they name. Returns the photographs, and warnings for the user.
    Raises UserError.
    """
    layout = _layout(Folder(folder, follow), camera_size, sphere, up)
    if len(layout.files) < FEWEST:
        raise UserError(f"{show(folder)}: {len(layout.files)} photographs with cameras; at least {FEWEST} are needed")
    pixels = sum(file.size[0] * file.size[1] for file in layout.files)
    factor = scale or min(1.0, (PIXELS / pixels) ** 0.5)
    if factor**2 * pixels > MOST_PIXELS:
        raise UserError(f"{show(folder)}: too many pixels for the memory; set a smaller --scale")
    loaded: Loaded = {}
    photographs = tuple(load_photograph(file, factor, layout.to_model, loaded) for file in layout.files)
    masks = [view.mask for view in photographs if view.mask is not None]
    if masks and not any(mask.any() for mask in masks):
        raise UserError(f"{show(folder)}: all masks are black; white is where the object is")
    warnings = list(layout.warnings)
    if 0 < len(masks) < len(photographs):
        warnings.append(f"{len(photographs) - len(masks)} photographs have no mask: ignoring all masks")
        photographs = tuple(replace(view, mask=None) for view in photographs)
    x, y, z = (float(number) for number in layout.center)
    name = folder.resolve().name or "photographs"
    return Photographs(name, photographs, (x, y, z), float(layout.radius), layout.up), warnings


def _layout(
    root: Folder, camera_size: tuple[int, int] | None, sphere: tuple[float, float, float, float] | None, up: str | None
) -> Layout:
    folder = root.path
    if not is_folder(folder):
        raise UserError(f"{show(folder)}: no such folder")
    for name in CAMERAS:
        if (path := root.find(name)) is not None:
            if sphere is not None:
                raise UserError(f"--sphere: {name} already has the ball around the object")
            return find_in_sphere(root, path, camera_size, up)
    ball = None if sphere is None else np.array(sphere)
    for name in TRANSFORMS:
        if (path := root.find(name)) is not None:
            if camera_size is not None:
                raise UserError(f"--camera-size: {name} already has the size of the photographs")
            return find_in_transforms(root, path, ball, up)
    if (sparse := sparse_model(root)) is not None:
        if camera_size is not None:
            raise UserError("--camera-size: COLMAP's cameras already have the size of the photographs")
        return find_in_colmap(root, sparse, ball, up)
    raise UserError(f"{show(folder)}: no cameras; {CAMERAS[0]}, {TRANSFORMS[0]} or COLMAP's sparse/0 is needed")
