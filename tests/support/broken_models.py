"""Model files that are wrong, and what is said of each: one table for Python and for the page."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import load as tensors_of
from safetensors.numpy import save as to_safetensors

from mplicits.model.files import show
from mplicits.model.model_file import VERSION, to_bytes
from support.packed_model import packed_model
from support.random_model import random_model

Change = Callable[[bytes], bytes]
MODEL = random_model((8, 1), (12, 2), texture=(8, 1))
FILES = {
    "plain": to_bytes(MODEL),
    "packed": to_bytes(packed_model(MODEL)),
    "front": to_bytes(replace(MODEL, front=(30.0, 20.0), credit="somebody", up="z")),
}
"""Whole files, by kind."""


class Wrong(NamedTuple):
    """What is wrong in a file."""

    change: Change
    """The change of a whole file."""
    said: str
    """A part of Python's message."""
    on_page: str = ""
    """A part of the page's message, if it is another."""
    kind: str = "plain"

    @property
    def data(self) -> bytes:
        """The bytes of the wrong file."""
        return self.change(FILES[self.kind])


def parts(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the header of a model file, and the bytes behind it."""
    end = 8 + int.from_bytes(data[:8], "little")
    return json.loads(data[8:end]), data[end:]


def changed(data: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """Return a model file after a change of its header."""
    header, rest = parts(data)
    change(header)
    text = json.dumps(header).encode()
    return len(text).to_bytes(8, "little") + text + rest


def describe(data: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """Return a model file after a change of the description in its header."""

    def inside(header: dict[str, Any]) -> None:
        description = json.loads(header["__metadata__"]["model"])
        change(description)
        header["__metadata__"]["model"] = json.dumps(description)

    return changed(data, inside)


def metadata(**values: object) -> Change:
    """Return a change of values beside the description."""
    return lambda data: changed(data, lambda header: header["__metadata__"].update(values))


def described(**values: object) -> Change:
    """Return a change of values of the description."""
    return lambda data: describe(data, lambda description: description.update(values))


def level(**values: object) -> Change:
    """Return a change of values of the first level's description."""
    return lambda data: describe(data, lambda description: description["levels"][0].update(values))


def entry(name: str, **values: object) -> Change:
    """Return a change of the header's entry of a tensor."""
    return lambda data: changed(data, lambda header: header[name].update(values))


def tensor(name: str, value: NDArray[Any] | None) -> Change:
    """Return a change of one tensor, or its removal, in a file whose other parts are whole."""

    def change(data: bytes) -> bytes:
        tensors = tensors_of(data) | {name: value}
        kept = {key: each for key, each in tensors.items() if each is not None}
        return to_safetensors(kept, parts(data)[0]["__metadata__"])

    return change


def overlap(header: dict[str, Any]) -> None:
    """Name the bytes of the largest tensor a thousand times."""
    spans = {name: each["data_offsets"] for name, each in header.items() if name != "__metadata__"}
    largest = max(spans, key=lambda name: spans[name][1] - spans[name][0])
    header.update({f"more{i}": header[largest] for i in range(1000)})


def with_one(value: float, *shape: int) -> NDArray[np.float32]:
    """Return zeros with `value` at their end."""
    array = np.zeros(shape, np.float32)
    array.flat[-1] = value
    return array


def zeros(*shape: int) -> NDArray[np.float32]:
    """Return zeros."""
    return np.zeros(shape, np.float32)


NO_FILE, DAMAGED = "not a model file, or a damaged one", "cut short or damaged"
PAGE_NO_FILE = "not a model file (.safetensors), or a damaged one"
WRONG: dict[str, Wrong] = {
    "empty": Wrong(lambda _: b"", NO_FILE, PAGE_NO_FILE),
    "zeros": Wrong(lambda _: bytes(300), NO_FILE, PAGE_NO_FILE),
    "cut short": Wrong(lambda data: data[:-100], NO_FILE, DAMAGED),
    "trailing byte": Wrong(lambda data: data + b"\0", NO_FILE, DAMAGED),
    "overlapping": Wrong(lambda data: changed(data, overlap), NO_FILE, "the tensors overlap: the file is damaged"),
    "no metadata": Wrong(lambda data: changed(data, lambda h: h.pop("__metadata__")), "not an mplicits model"),
    "no format": Wrong(lambda data: changed(data, lambda h: h["__metadata__"].pop("format")), "not an mplicits model"),
    "other format": Wrong(metadata(format="pt"), "'format'"),
    "future": Wrong(metadata(version=str(VERSION + 1)), f"format version {VERSION + 1} is newer"),
    "version 3 of a plain file": Wrong(
        metadata(version="3"), "packed: the tensor or the sizes", "packed: must be float32"
    ),
    "huge version": Wrong(metadata(version="9" * 5000), "'version'"),
    "version 0": Wrong(metadata(version="0"), "'version'"),
    "no version": Wrong(metadata(version=""), "'version'"),
    "words as version": Wrong(metadata(version="one\ntwo"), "'version'"),
    "a number as version": Wrong(metadata(version=1), NO_FILE, PAGE_NO_FILE),
    "no description": Wrong(metadata(model=""), "'model' is not JSON"),
    "not JSON": Wrong(metadata(model="not JSON\n"), "'model' is not JSON"),
    "deep JSON": Wrong(metadata(model="[" * 100_000), "'model' is not JSON"),
    "a list": Wrong(metadata(model="[1]"), "'model'"),
    "huge number": Wrong(metadata(model="9" * 10_000), "'model'"),
    "no name": Wrong(metadata(model="{}"), "key 'name' is missing", "name: not a text"),
    "no provenance": Wrong(
        lambda data: describe(data, lambda d: d.pop("provenance")), "key 'provenance' is missing", "provenance: is not"
    ),
    "scale": Wrong(described(scale=0), "scale: must be positive", "scale: must be a positive number"),
    "centre": Wrong(described(centre=[0, 0]), "centre: three numbers", "centre: three finite numbers"),
    "front": Wrong(described(front=[1]), "front: two numbers are needed", "front: azimuth from -360 to 360"),
    "credit": Wrong(described(credit=3), "'credit' is not a text", "credit: not a text"),
    "lipschitz": Wrong(level(lipschitz=-1.0), "levels[1].lipschitz: must be"),
    "delta": Wrong(level(delta=-1), "levels[1].delta: must be positive", "levels[1].delta: must be a positive number"),
    "step bound": Wrong(
        level(step_bound=1.5), "levels[1].step_bound: must be at most 1", "a positive number of at most 1"
    ),
    "halves": Wrong(entry("level1.layer0.bias", dtype="F16"), NO_FILE, "level1.layer0.bias: must be float32"),
    "shape and bytes": Wrong(
        entry("level1.layer0.weight", shape=[3, 4]), NO_FILE, f"level1.layer0.weight: the file is {DAMAGED}"
    ),
    "packed, lipschitz": Wrong(level(lipschitz=-1.0), "levels[1].lipschitz: must be", kind="packed"),
    "packed, trailing bytes": Wrong(lambda data: data + b"12345678", NO_FILE, DAMAGED, kind="packed"),
    "packed, a stray tensor": Wrong(
        tensor("level1.layer0.bias", zeros(8)), "level1.layer0.bias: a tensor beside the packed ones", kind="packed"
    ),
    "packed, more weights than are read": Wrong(
        lambda data: describe(data, lambda d: d["packed"].update(level1=[3, 4000, 4000, 1])),
        f"packed: 16016448 weights in 873 bytes; the file is {DAMAGED}",
        f"packed: the file is {DAMAGED}",
        kind="packed",
    ),
}

TENSORS: list[tuple[str, NDArray[Any] | None, str, str]] = [
    # Tensor, value, said of it, and by the page, if it says something else.
    ("level2.layer1.bias", with_one(np.nan, 12), "has values that are not finite", ""),
    ("texture.layer0.weight", with_one(-np.inf, 8, 3), "has values that are not finite", ""),
    ("level1.layer0.weight", zeros(8, 2), "shape (8, 2), expected (out, 3)", ""),
    ("level1.layer0.weight", zeros(8), "shape (8,), expected (out, 3)", "shape (8), expected (out, 3)"),
    ("level1.layer0.weight", zeros(0, 3), "0 outputs, expected 1 to 4096", ""),
    ("level1.layer0.weight", zeros(4097, 3), "4097 outputs, expected 1 to 4096", ""),
    ("level1.layer2.weight", zeros(3, 8), "3 outputs, expected 1", "shape (1), expected (3,)"),
    ("level1.layer1.bias", zeros(9), "shape (9,), expected (8,)", "shape (9), expected (8,)"),
    ("level1.layer1.bias", zeros(), "shape (), expected (8,)", ""),
    ("level2.layer1.weight", zeros(12, 8), "shape (12, 8), expected (out, 12)", ""),
    ("level2.layer0.bias", np.zeros(12), "must be float32", ""),
    ("level2.layer0.bias", np.zeros(12, np.int32), "must be float32", ""),
    ("texture.layer2.weight", zeros(1, 8), "1 outputs, expected 3", "shape (3), expected (1,)"),
    ("level2.layer1.bias", None, "missing", ""),
    ("level3.layer0.weight", zeros(1, 3), "not a tensor of a model with 2 levels", ""),
    ("extra\nline", zeros(1), "not a tensor of a model", "not a tensor of a model"),
]
WRONG |= {
    f"{name} {said}": Wrong(tensor(name, value), f"{show(name)}: {said}", page) for name, value, said, page in TENSORS
}
