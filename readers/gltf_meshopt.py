"""Decompresses views of EXT_meshopt_compression and KHR_meshopt_compression, by meshoptimizer (extra `meshopt`).

The library only asserts what the extension demands, and writes beyond its arrays where assertions are off: all of it is
checked before.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.files import show
from .child import Child
from .frames import Arrays

HEADERS = {"ATTRIBUTES": (0xA0, 0xA1), "TRIANGLES": (0xE0, 0xE1), "INDICES": (0xD0, 0xD1)}
"""Mode -> what the first byte may be."""
STRIDES = {
    "ATTRIBUTES": range(4, 257, 4),
    "TRIANGLES": (2, 4),
    "INDICES": (2, 4),
    "NONE": range(1, 257),
    "OCTAHEDRAL": (4, 8),
    "QUATERNION": (8,),
    "EXPONENTIAL": range(4, 257, 4),
}
"""Mode or filter -> bytes that an item may have."""
MOST = 1 << 28  # most bytes of a view


def decompressed(child: Child, size: int, data: NDArray[np.uint8], described: dict[str, Any]) -> bytes:
    """Return a view's bytes. size: of the file. described: the extension's object.

    Raises KeyError, TypeError and ValueError for what the extension forbids and the decoder refuses, UserError where it
    crashes, and ModuleNotFoundError without meshoptimizer.
    """
    count, stride = int(described["count"]), int(described["byteStride"])
    mode, transform = described["mode"], described.get("filter", "NONE")
    check(count, stride, mode, transform, data[:1].tobytes())
    arguments = {"count": count, "stride": stride, "mode": mode, "transform": transform}
    found = child.call(decoded, ("meshoptimizer",), size, data=data, **arguments)
    return found["bytes"].tobytes()


def check(count: int, stride: int, mode: object, transform: object, first: bytes) -> None:
    """Raise ValueError for what the extension forbids. first: the first byte of the data."""
    for name in (mode, transform):
        if not isinstance(name, str) or name not in STRIDES:
            raise ValueError(f"mode or filter {show(str(name))[:20]}")
        if stride not in STRIDES[name]:
            raise ValueError(f"{name} with a stride of {stride}")
    if mode not in HEADERS or transform in HEADERS:
        raise ValueError(f"mode {mode} and filter {transform}")
    if transform != "NONE" and mode != "ATTRIBUTES":
        raise ValueError(f"filter {transform} in mode {mode}")
    if not 0 < count * stride <= MOST:
        raise ValueError(f"{count} items of {stride} bytes")
    if mode == "TRIANGLES" and count % 3:
        raise ValueError(f"{count} indices of triangles")
    if not first or first[0] not in HEADERS[str(mode)]:
        raise ValueError(f"no data of mode {mode}")


def decoded(data: NDArray[np.uint8], count: int, stride: int, mode: str, transform: str) -> Arrays:
    """Return the "bytes" of a view, after `check`."""
    import meshoptimizer

    if mode != "ATTRIBUTES":
        decode = meshoptimizer.decode_index_buffer if mode == "TRIANGLES" else meshoptimizer.decode_index_sequence
        # The library fills the first bytes of an array of 32 bits.
        indices = np.asarray(decode(count, stride, data))
        return {"bytes": indices.reshape(-1).view(np.uint8)[: stride * count]}
    filters = {
        "OCTAHEDRAL": meshoptimizer.decode_filter_oct,
        "QUATERNION": meshoptimizer.decode_filter_quat,
        "EXPONENTIAL": meshoptimizer.decode_filter_exp,
    }
    values = np.asarray(meshoptimizer.decode_vertex_buffer(count, stride, data)).reshape(-1).view(np.uint8)
    return {"bytes": values if transform == "NONE" else np.asarray(filters[transform](values, count, stride))}
