"""Sends arrays through a pipe: one line of JSON that describes them, and their bytes. Nothing is unpickled."""

import json
from collections.abc import Mapping
from math import prod
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]
LONGEST = 1 << 24  # most bytes of the line of JSON


def send(stream: IO[bytes], head: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a frame: a JSON object, and arrays of numbers by name. Raises OSError if nobody reads."""
    whole = {name: np.ascontiguousarray(array).reshape(array.shape) for name, array in arrays.items()}
    described = {name: [array.dtype.str, array.shape] for name, array in whole.items()}
    stream.write(json.dumps([head, described]).encode() + b"\n")
    for array in whole.values():
        stream.write(array.reshape(-1).view(np.uint8).data)
    stream.flush()


def receive(stream: IO[bytes], most: float) -> tuple[dict[str, Any], Arrays]:
    """Read a frame. Raises EOFError where the stream ends, and MemoryError for arrays of more than `most` bytes."""
    line = stream.readline(LONGEST)
    if not line.endswith(b"\n"):
        raise EOFError
    head, described = json.loads(line)
    shapes = {name: (np.dtype(kind), tuple(map(int, shape))) for name, (kind, shape) in described.items()}
    if sum(kind.itemsize * prod(shape) for kind, shape in shapes.values()) > most:
        raise MemoryError
    arrays = {name: _array(stream, kind, shape) for name, (kind, shape) in shapes.items()}
    return head, arrays


def _array(stream: Any, kind: np.dtype[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    if kind.kind not in "biuf":
        raise ValueError(f"an array of {kind}")
    array = np.empty(shape, kind)
    if array.nbytes and stream.readinto(array.reshape(-1).view(np.uint8).data) != array.nbytes:
        raise EOFError
    return array
