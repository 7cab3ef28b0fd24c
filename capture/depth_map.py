"""Reading a depth map: how far away what each pixel shows is."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..model.errors import UserError
from ..model.files import show

Doubles = NDArray[np.float64]

SUFFIXES = (".png", ".exr", ".npy", ".tif", ".tiff")
SMALLEST, LARGEST = 8, 1 << 15
"""Pixels that a side of a depth map has, at least and at most."""
DEPTH_CHANNELS = ("z", "depth", "v", "y", "r")
"""Last parts of the names that programs give to the depth in an EXR file, in the order in which they are looked for."""
FEW_LEVELS = 4096
"""A map with at most so many different values is rounded to them: 8 bits give 255."""


def read_depth(path: Path) -> tuple[Doubles, bool]:
    """Read a depth map: 16-bit or 8-bit PNG, TIFF of whole numbers or floats, EXR, NPY.

    Returns the numbers of the file (H, W), NaN where there is nothing (0, negative, infinite or NaN in the file), and
    whether they are whole numbers. Raises UserError, one line that names the file.
    """
    name, suffix = show(path), path.suffix.lower()
    if suffix not in SUFFIXES:
        raise UserError(f"{name}: no format of depth maps by that ending; PNG, EXR, NPY and TIFF are read")
    try:
        values = {".npy": _read_npy, ".exr": _read_exr}.get(suffix, _read_image)(path)
    except UserError as error:
        raise UserError(f"{name}: {error}") from None
    except ModuleNotFoundError:
        raise
    except Exception as error:  # Pillow, NumPy and OpenEXR raise anything on damaged files
        reason = "no such file" if isinstance(error, FileNotFoundError) else f"not a readable {suffix[1:].upper()} file"
        raise UserError(f"{name}: {reason}") from None
    if values.ndim != 2 or not SMALLEST <= min(values.shape) <= max(values.shape) <= LARGEST:
        shape = " x ".join(map(str, values.shape)) or "no array"
        raise UserError(f"{name}: {shape}; a depth map has two axes of {SMALLEST} to {LARGEST:,} pixels")
    depth = values.astype(np.float64)
    with np.errstate(invalid="ignore"):
        depth[~(np.isfinite(depth) & (depth > 0))] = np.nan
    if np.isnan(depth).all():
        raise UserError(f"{name}: no pixel has a depth: all are 0, negative or not finite")
    return depth, bool(np.issubdtype(values.dtype, np.integer))


def _read_npy(path: Path) -> NDArray[Any]:
    values: NDArray[Any] = np.load(path, allow_pickle=False)
    if values.dtype.kind not in "iuf":
        raise UserError(f"an array of {values.dtype}; a depth map has numbers")
    return values.squeeze()


def _read_image(path: Path) -> NDArray[Any]:
    with Image.open(path) as opened:
        values = np.asarray(opened)
    if values.dtype == np.bool_:
        raise UserError("a picture of black and white; a depth map has many depths")
    if values.ndim == 3:  # grey with alpha, or grey saved as colours
        colours = values[..., : 3 if values.shape[2] > 2 else 1]
        if (colours != colours[..., :1]).any():
            raise UserError("a picture in colours; a depth map has one number for each pixel")
        values = np.where(values[..., -1] > 0, values[..., 0], 0) if values.shape[2] in (2, 4) else values[..., 0]
    return values


def _read_exr(path: Path) -> NDArray[Any]:
    import OpenEXR

    if not path.is_file():
        raise FileNotFoundError
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name.rpartition(".")[2].lower(): channel for name, channel in file.channels().items()}
        found = next((name for name in DEPTH_CHANNELS if name in channels), None)
        if found is None:
            raise UserError(f"no channel of depths in it; its channels are {', '.join(map(show, file.channels()))}")
        return np.array(channels[found].pixels)


def from_inverse(values: Doubles, near: float, far: float) -> Doubles:
    """Turn relative inverse depths, of which larger ones are nearer, into depths from `near` to `far`.

    Neither the unit nor the zero of such numbers is known (Depth Anything V2 and MiDaS give them so). values: (H, W),
    NaN where there is nothing. Returns (H, W). Raises UserError where all are the same.
    """
    lowest, highest = np.nanmin(values), np.nanmax(values)
    if lowest == highest:
        raise UserError("all depths are the same; a shape has nearer and farther parts")
    share = (values - lowest) / (highest - lowest)
    return np.asarray(1 / (share / near + (1 - share) / far))


def step_of(values: Doubles) -> float:
    """Return the distance between neighbouring values of a map that holds few different ones, 0 where it holds many."""
    levels = np.unique(values[~np.isnan(values)])
    return float(np.median(np.diff(levels))) if 1 < len(levels) <= FEW_LEVELS else 0.0
