"""Model files whose header is changed."""

import json
import struct
from collections.abc import Callable
from typing import Any


def changed(data: bytes, change: Callable[[dict[str, Any]], None]) -> bytes:
    """Return the bytes of a model file after a change of its header."""
    (length,) = struct.unpack("<Q", data[:8])
    header = json.loads(data[8 : 8 + length])
    change(header)
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + data[8 + length :]


def describe(change: Callable[[dict[str, Any]], None]) -> Callable[[dict[str, Any]], None]:
    """Return a change of the header that changes the JSON description inside it."""

    def inside(header: dict[str, Any]) -> None:
        description = json.loads(header["__metadata__"]["model"])
        change(description)
        header["__metadata__"]["model"] = json.dumps(description)

    return inside
