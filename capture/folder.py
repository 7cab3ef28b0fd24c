"""Reading a folder of photographs, whichever layout it has."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..model.errors import UserError
from ..model.files import is_folder, show
from .pictures import LARGEST, Found, posed
from .posed import Photographs
from .sphere_cameras import find_in_sphere
from .transforms import TRANSFORMS, find_in_transforms

CAMERAS = ("cameras_sphere.npz", "cameras.npz")
"""What IDR and NeuS call the file of the cameras."""
FEWEST = 3
"""Photographs from fewer sides do not tell a shape."""
PIXELS = 4e6
"""All photographs together have at most so many pixels where --scale does not say otherwise."""


def read_photographs(
    folder: Path,
    scale: float | None = None,
    camera_size: tuple[int, int] | None = None,
    sphere: tuple[float, float, float, float] | None = None,
    up: str | None = None,
) -> tuple[Photographs, list[str]]:
    """Read the photographs in a folder, of the layout of IDR and NeuS or with a transforms.json, and their cameras.

    scale: factor on the sides of the pictures, at most 1; None: 1, or what makes `PIXELS` of them in all. camera_size:
    width and height that the cameras of cameras_sphere.npz are for; None: those of the pictures. sphere: centre and
    radius of the ball that the object is in, for a transforms.json. up: axis of the cameras' space that points up;
    None: as the pictures have it. Returns them, and warnings for the user. Raises UserError, one line.
    """
    found = _find(folder, camera_size, sphere, up)
    views = found.views
    if len(views) < FEWEST:
        raise UserError(f"{show(folder)}: {len(views)} photographs with cameras; at least {FEWEST} are needed")
    factor = scale or min(1.0, (PIXELS / sum(view.width * view.height for view in views)) ** 0.5)
    photographs = tuple(posed(view, factor, found.to_model) for view in views)
    masks = [view.mask for view in photographs if view.mask is not None]
    if masks and not any(mask.any() for mask in masks):
        raise UserError(f"{show(folder)}: all masks are black; white is where the object is")
    if sum(view.colours.size // 3 for view in photographs) > LARGEST:
        raise UserError(f"{show(folder)}: too many pixels for the memory; give a smaller --scale")
    if 0 < len(masks) < len(photographs):
        found.warnings.append(f"{len(photographs) - len(masks)} photographs have no mask: no masks are used")
        photographs = tuple(replace(view, mask=None) for view in photographs)
    x, y, z = (float(number) for number in found.centre)
    name = folder.resolve().name or "photographs"
    return Photographs(name, photographs, (x, y, z), float(found.radius), found.up), found.warnings


def _find(
    folder: Path,
    camera_size: tuple[int, int] | None,
    sphere: tuple[float, float, float, float] | None,
    up: str | None,
) -> Found:
    if not is_folder(folder):
        raise UserError(f"{show(folder)}: no such folder")
    for name in CAMERAS:
        if (folder / name).is_file():
            if sphere is not None:
                raise UserError(f"--sphere: {name} says itself where the object is")
            return find_in_sphere(folder, folder / name, camera_size, up)
    if (folder / TRANSFORMS).is_file():
        if camera_size is not None:
            raise UserError(f"--camera-size: {TRANSFORMS} says itself what size its cameras are for")
        return find_in_transforms(folder, None if sphere is None else np.array(sphere), up)
    raise UserError(f"{show(folder)}: no cameras in it; {CAMERAS[0]} or {TRANSFORMS} is needed")
