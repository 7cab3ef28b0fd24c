"""Reads depth maps."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import reason_of, regular, show, silent_library
from ..model.image_file import load_pixels, opened_image
from ..model.memory import check_memory
from .cloud import Doubles

SMALLEST, LARGEST = 8, 1 << 15  # bounds of the sides of a depth map, pixels
BYTES = 500
"""Memory that `unproject` takes for each pixel, as measured at 2000 x 2000 and 4000 x 4000 pixels with --close; without
it, 300 to 360. --estimate takes less before: 30, and 400 MB for the libraries."""
LEAST = 1e-15  # smaller depths are nothing
DEPTH_CHANNELS = (
    *(r"(^|.*\.)(z?depth|z)\.(z|v|y|r|x)", r"z", r"(z?depth|distance)", r".*\.(depth|z?depth)"),
    *(r"v", r"y", r"r", r"(?!.*(normal|position|vector|combined|image|uv|mist)).*\.(z|v|y|r)"),
)
"""Patterns of the names of depth channels in EXR files, in lower case and in the order of preference."""
NOTHING = 1e9  # larger depths are nothing: Blender writes 1e10
HALF = 65_504.0  # largest number of 16 bits: nothing, too
FULL = 65_535  # in a map of 16-bit whole numbers
FAR_SHARE, FAR_STEP = 0.01, 4.0
"""The largest depth is a background if it has a larger share of the pixels, and is this many times the next one."""
FEW_LEVELS = 4096  # A map with at most this number of different values is treated as rounded; 8 bits give 255


@dataclass(frozen=True, eq=False)
class DepthMap:
    """The numbers of a depth map."""

    values: Doubles
    """(H, W), NaN for missing depths."""
    whole: bool
    """Whether they are integers in the file."""
    notes: tuple[str, ...] = ()
    """For people: the channel, and a background that is left out."""


def read_depth(path: Path) -> DepthMap:
    """Read a depth map: 16-bit or 8-bit PNG, TIFF of integers or floats, EXR, NPY.

    Missing depths are 0, negative, less than `LEAST`, infinite, NaN, or a number that programs write for nothing
    (`NOTHING`, `HALF`, `FULL`, or a background at one far depth). Raises UserError with the file's name.
    """
    name, suffix = show(path), path.suffix.lower()
    if suffix not in READERS:
        raise UserError(f"{name}: unknown format of depth maps; this program reads PNG, EXR, NPY and TIFF")
    notes = []
    try:
        values = READERS[suffix](regular(path))
        if isinstance(values, tuple):
            values, channel = values
            notes.append(f"depths from the channel {show(channel)}")
    except UserError as error:
        raise UserError(f"{name}: {error}") from None
    except ModuleNotFoundError:
        raise
    except Exception as error:  # Pillow, NumPy and OpenEXR raise anything on damaged files
        raise UserError(f"{name}: {reason_of(error, f'not a readable {suffix[1:].upper()} file')}") from None
    depth = values.astype(np.float64)
    with np.errstate(invalid="ignore"):
        depth[~((depth >= LEAST) & (depth < NOTHING))] = np.nan
        depth[depth == (FULL if values.dtype == np.uint16 else HALF)] = np.nan
    if (far := _background(depth)) is not None:
        notes.append(f"{np.count_nonzero(depth == far):,} pixels at the depth {far:g} left out: a background")
        depth[depth == far] = np.nan
    if np.isnan(depth).all():
        raise UserError(f"{name}: no pixel has a depth: all are 0, negative, or too large or small")
    return DepthMap(depth, bool(np.issubdtype(values.dtype, np.integer)), tuple(notes))


def _background(depth: Doubles) -> float | None:
    """Return the depth (H, W) that stands for the background: the largest, of many pixels and far away; else None."""
    known = depth[~np.isnan(depth)]
    if not len(known):
        return None
    far = float(known.max())
    nearer = known[known < far]
    is_far = len(nearer) > 0 and far > FAR_STEP * float(nearer.max())
    return far if is_far and len(known) - len(nearer) > FAR_SHARE * depth.size else None


def check_size(shape: Sequence[int]) -> None:
    """Check the shape of a map before its pixels are read. Raises UserError."""
    if len(shape) != 2 or not SMALLEST <= min(shape) <= max(shape) <= LARGEST:
        size = " x ".join(map(str, shape)) or "no array"
        raise UserError(f"{size}; a depth map has two axes of {SMALLEST} to {LARGEST:,} pixels")
    check_memory(BYTES * shape[0] * shape[1], f"a depth map of {shape[1]} x {shape[0]}", "shrink it")


def _read_npy(path: Path) -> NDArray[Any]:
    mapped: NDArray[Any] = np.load(path, mmap_mode="r", allow_pickle=False)
    if mapped.dtype.kind not in "iuf":
        raise UserError(f"an array of {mapped.dtype}; a depth map has numbers")
    check_size([side for side in mapped.shape if side != 1])
    return np.array(mapped.squeeze())


def _read_image(path: Path) -> NDArray[Any]:
    if _is_cut(path):
        raise UserError("a picture of 16 bits with colors or opacity; save it as gray of 16 bits")
    with opened_image(path) as opened:
        check_size(opened.size[::-1])
        load_pixels(opened)
        values = np.asarray(opened.convert("RGB") if opened.mode == "P" else opened)  # a palette's numbers say nothing
    if values.dtype == np.bool_:
        raise UserError("a black and white picture; a depth map has many depths")
    if values.ndim == 3:  # gray with alpha, or gray saved as RGB
        colors = values[..., : 3 if values.shape[2] > 2 else 1]
        if (colors != colors[..., :1]).any():
            raise UserError("a color picture; a depth map has one number per pixel")
        values = np.where(values[..., -1] > 0, values[..., 0], 0) if values.shape[2] in (2, 4) else values[..., 0]
    return values


def _is_cut(path: Path) -> bool:
    """Whether Pillow cuts a PNG file to 8 bits: it has 16, and more than gray."""
    with path.open("rb") as file:
        head = file.read(26)
    return head.startswith(b"\x89PNG") and len(head) == 26 and head[24] == 16 and head[25] != 0


def _read_exr(path: Path) -> tuple[NDArray[Any], str]:
    """Return the pixels of the depth channel, and its name. Raises UserError."""
    import OpenEXR

    if not path.is_file():
        raise FileNotFoundError
    with silent_library(), OpenEXR.File(str(path), header_only=True) as file:
        (left, top), (right, bottom) = np.array(file.header()["dataWindow"]).tolist()
        check_size((bottom - top + 1, right - left + 1))
    with silent_library(), OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        names = [(pattern, name) for pattern in DEPTH_CHANNELS for name in channels]
        pixels = {name: np.array(channel.pixels) for name, channel in channels.items()}
        matching = (name for pattern, name in names if re.fullmatch(pattern, name.lower()))
        found = next((name for name in matching if not _is_one_of_three(name, pixels)), None)
        if found is None:
            raise UserError(f"no depth channel; its channels are {', '.join(map(show, channels))}")
        return pixels[found], found


def _is_one_of_three(name: str, pixels: dict[str, NDArray[Any]]) -> bool:
    """Whether a channel belongs to a color or a vector: its layer has others of R, G, B or X, Y, Z that differ."""
    layer, last = name[:-1], name[-1].upper()
    three = next((each for each in ("RGB", "XYZ") if last in each), "")
    if three == "XYZ" and not all(layer + other in pixels for other in three):
        return False
    others = [pixels[layer + other] for other in three if layer + other in pixels]
    return any(other.shape != pixels[name].shape or (other != pixels[name]).any() for other in others)


READERS: dict[str, Callable[[Path], NDArray[Any] | tuple[NDArray[Any], str]]] = {
    ".png": _read_image,
    ".exr": _read_exr,
    ".npy": _read_npy,
    ".tif": _read_image,
    ".tiff": _read_image,
}


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
