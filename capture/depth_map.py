"""Reads depth maps."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..model.errors import UserError
from ..model.files import show
from .cloud import Doubles

SMALLEST, LARGEST = 8, 1 << 15  # bounds of the sides of a depth map, pixels
DEPTH_CHANNELS = ("z", "depth", "v", "y", "r")
"""Last parts of the names of depth channels in EXR files, in the order of preference."""
FEW_LEVELS = 4096  # A map with at most this number of different values is treated as rounded; 8 bits give 255


def read_depth(path: Path) -> tuple[Doubles, bool]:
    """Read a depth map: 16-bit or 8-bit PNG, TIFF of integers or floats, EXR, NPY.

    Returns the numbers of the file (H, W), NaN for missing depths (0, negative, infinite or NaN in the file), and
    whether they are integers. Raises UserError with the file's name.
    """
    name, suffix = show(path), path.suffix.lower()
    if suffix not in READERS:
        raise UserError(f"{name}: unknown format of depth maps; this program reads PNG, EXR, NPY and TIFF")
    try:
        values = READERS[suffix](path)
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
        raise UserError("a black and white picture; a depth map has many depths")
    if values.ndim == 3:  # gray with alpha, or gray saved as RGB
        colors = values[..., : 3 if values.shape[2] > 2 else 1]
        if (colors != colors[..., :1]).any():
            raise UserError("a color picture; a depth map has one number per pixel")
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
            raise UserError(f"no depth channel; its channels are {', '.join(map(show, file.channels()))}")
        return np.array(channels[found].pixels)


READERS = {".png": _read_image, ".exr": _read_exr, ".npy": _read_npy, ".tif": _read_image, ".tiff": _read_image}


def from_inverse(values: Doubles, near: float, far: float) -> Doubles:
    """Turn relative inverse depths (larger is nearer) into depths from `near` to `far`.

    Depth Anything V2 and MiDaS return such numbers, whose unit and zero are unknown. values: (H, W), NaN where missing.
    Returns (H, W). Raises UserError if all are equal.
    """
    lowest, highest = np.nanmin(values), np.nanmax(values)
    if lowest == highest:
        raise UserError("all depths are the same; a shape has nearer and farther parts")
    share = (values - lowest) / (highest - lowest)
    return np.asarray(1 / (share / near + (1 - share) / far))


def step_of(values: Doubles) -> float:
    """Return the rounding step of a map with few different values; 0 for a map with many."""
    levels = np.unique(values[~np.isnan(values)])
    return float(np.median(np.diff(levels))) if 1 < len(levels) <= FEW_LEVELS else 0.0
