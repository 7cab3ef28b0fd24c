"""Reads the arrays of glTF: views of buffers, compressed or not, and accessors, sparse or normalized."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from .child import child_of
from .gltf_file import DAMAGED, Gltf, extension, needing
from .gltf_meshopt import decompressed
from .values import Doubles

TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4", 5130: "f8"}
"""componentType -> NumPy's type."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
LARGEST = {"i1": 127.0, "u1": 255.0, "i2": 32767.0, "u2": 65535.0, "u4": 4294967295.0}
"""Type -> the number that stands for 1 in a normalized accessor."""
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
MOST = 1 << 28  # most numbers of an accessor
ARRAYS = 96
"""Bytes that a number of an accessor takes: as a double, and in copies of the mesh."""


def accessor(gltf: Gltf, index: object) -> NDArray[Any]:
    """Read an accessor: (N, K) of its own type, or doubles if it is normalized. Raises UserError."""
    described = gltf.item("accessors", index)
    try:
        kind, width = TYPES[described["componentType"]], WIDTHS[described["type"]]
        count, offset = int(described["count"]), int(described.get("byteOffset", 0))
    except (KeyError, TypeError, ValueError):
        raise UserError(f"{DAMAGED} (accessor {show(str(index))[:20]} has no known type)") from None
    if count < 0 or offset < 0 or count * width > MOST:
        raise UserError(f"{DAMAGED} (accessor {index} has {str(count)[:20]} items)")
    gltf.claims.take(ARRAYS * count * width, "its arrays")
    if "bufferView" in described:
        values = _view_items(gltf, described["bufferView"], offset, kind, width, count)
    else:
        values = np.zeros((count, width), kind)
    if isinstance(sparse := described.get("sparse"), dict):
        values = _with_sparse(gltf, values.copy(), sparse, kind, width)
    return normalized(values) if described.get("normalized") else values


def normalized(values: NDArray[Any]) -> NDArray[Any]:
    """Divide whole numbers by the largest of their type, as OpenGL does; floats stay."""
    largest = LARGEST.get(values.dtype.str[1:])
    return values if largest is None else np.maximum(values.astype(np.float64) / largest, -1.0)


def doubles(gltf: Gltf, index: object, width: int) -> Doubles:
    """Read an accessor of numbers (N, width). Raises UserError for another width."""
    values = accessor(gltf, index)
    if values.shape[1] < width:
        raise UserError(f"{DAMAGED} (accessor {index} has {values.shape[1]} numbers an item; {width} are needed)")
    return values[:, :width].astype(np.float64)


def _with_sparse(gltf: Gltf, values: NDArray[Any], sparse: dict[str, Any], kind: str, width: int) -> NDArray[Any]:
    """Replace the items that a sparse accessor lists."""
    try:
        count, where, what = int(sparse["count"]), sparse["indices"], sparse["values"]
        at_kind = TYPES[where["componentType"]]
        at = _view_items(gltf, where["bufferView"], int(where.get("byteOffset", 0)), at_kind, 1, count)[:, 0]
        new = _view_items(gltf, what["bufferView"], int(what.get("byteOffset", 0)), kind, width, count)
    except (KeyError, TypeError, ValueError):
        raise UserError(f"{DAMAGED} (a sparse accessor)") from None
    if len(at) and at.max() >= len(values):
        raise UserError(f"{DAMAGED} (a sparse accessor names items that do not exist)")
    values[at.astype(np.int64)] = new
    return values


def view_bytes(gltf: Gltf, index: object) -> bytes:
    """Return the bytes of a view of a buffer, decompressed. Raises UserError."""
    described = gltf.item("bufferViews", index)
    assert isinstance(index, int)
    if index not in gltf.views:
        compressed = next((found for name in MESHOPT if (found := extension(described, name))), None)
        gltf.views[index] = _slice(gltf, described) if compressed is None else _meshopt(gltf, compressed)
    return gltf.views[index]


def _slice(gltf: Gltf, described: dict[str, Any]) -> bytes:
    buffer = gltf.buffer(described.get("buffer"))
    try:
        start, length = int(described.get("byteOffset", 0)), int(described["byteLength"])
    except (KeyError, TypeError, ValueError):
        raise UserError(f"{DAMAGED} (a view of a buffer has no length)") from None
    if start < 0 or length < 0 or start + length > len(buffer):
        raise UserError(f"{DAMAGED} (it is cut off: a view ends after its buffer)")
    gltf.claims.take(length, "its views of buffers")
    return buffer[start : start + length]


def _view_items(gltf: Gltf, view: object, offset: int, kind: str, width: int, count: int) -> NDArray[Any]:
    """Return items (count, width) of a view, whose stride may be larger than an item."""
    data = view_bytes(gltf, view)
    size = np.dtype(kind).itemsize
    stride = int(gltf.item("bufferViews", view).get("byteStride") or size * width)
    if count and (stride < size * width or offset + stride * (count - 1) + size * width > len(data)):
        raise UserError(f"{DAMAGED} (it is cut off: an accessor ends after its view)")
    return (
        np.ndarray((count, width), np.dtype("<" + kind), data, offset, (stride, size))
        if count
        else np.zeros((0, width), kind)
    )


def _meshopt(gltf: Gltf, compressed: dict[str, Any]) -> bytes:
    """Decompress a view of meshopt. Raises UserError, and ModuleNotFoundError without meshoptimizer."""
    data = np.frombuffer(_slice(gltf, compressed), np.uint8)
    try:
        with needing(MESHOPT[0]):
            return decompressed(child_of(gltf), gltf.claims.at_hand, data, compressed)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise UserError(f"{DAMAGED} (its meshopt data: {show(str(error))[:60]})") from None
