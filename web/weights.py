"""Weights of few bits for the packed page and for the module (model/safetensors.js reads them).

The page has whole numbers of 8 or 16 bits times a step. A tensor whose entries are multiples of a step, as training
with --packed leaves them, keeps its values exactly. Others are rounded to 16 bits, in steps of the largest entry over
32,767: in the range of a layer's weights, that is finer than float16, whose steps are finer near 0 alone. The module,
whose code is shorter, has packed weights (field/pack.py) instead of 16 bits; their search takes seconds.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..field.pack import packed
from ..field.rounding import decimals_line, in_decimals, is_float16, rounding_error, rounding_line
from ..model.errors import UserError
from ..model.model import Array, Layer, Model, Network
from ..model.model_file import to_bytes
from ..model.packed_weights import pack
from ..model.quantize import step_of

MOST_ERROR = 1e-4
"""Largest error of the distance near the surface, model units, with which weights are rounded."""
MOST_PACKED = 40_000
"""Largest number of weights that are packed here: the search takes a second of a processor for each 2,000."""
SMALL, LARGE = 127, 32767
"""Largest whole numbers of 8 and of 16 bits."""


@dataclass(frozen=True, eq=False)
class ShortWeights:
    """A model with short weights."""

    model: Model
    """The model with the weights that the page reads."""
    data: bytes
    """A model file with tensors of the types I8 and I16, and with their steps as `steps` in its metadata: a list of one
    for the tensor or of one for each row. Of 16-bit numbers, it has all high bytes before all low bytes."""
    error: tuple[float, float]
    """Largest and mean difference of the distance near the surface, model units."""
    kind: str = "weights of 16 bits"
    """What they are, for people."""


@dataclass(frozen=True, eq=False)
class PageWeights:
    """The weights of a page."""

    model: Model
    """The model with the weights that the page reads."""
    data: bytes | None
    """Their model file, as of `ShortWeights`; None where they are not short."""
    line: str | None
    """How far they are rounded, for people; None for exact weights."""


def page_weights(
    model: Model, digits: int | None, shorten: Callable[[Model], ShortWeights | None] | None
) -> PageWeights:
    """Choose the weights of a page. digits: decimals, None for all. shorten: a function below; None keeps the floats.

    Weights that are 16-bit floats already are kept.
    """
    chosen = model if digits is None else in_decimals(model, digits)
    short = None if shorten is None or is_float16(chosen) else shorten(chosen)
    line = None if digits is None else decimals_line(model, digits)
    if short:
        return PageWeights(short.model, short.data, line or rounding_line(short.kind, short.error))
    return PageWeights(chosen, None, line)


def coded_weights(model: Model) -> ShortWeights | None:
    """Return a model with packed weights, or else what `short_weights` returns."""
    short = short_weights(model)
    if (
        model.scene is not None
        or model.inputs != "xyz"
        or model.parameters() > MOST_PACKED
        or (short and not short.error[0])
    ):
        return short
    return _packed(model) or short


def _packed(model: Model) -> ShortWeights | None:
    """Return a model with packed weights; None where it is packed, has no surface, or the error exceeds MOST_ERROR."""
    if pack(model.networks()) is not None:
        return None
    try:
        result = packed(model, most=MOST_ERROR)
    except UserError:
        return None
    error = rounding_error(model, result.model)
    data = to_bytes(replace(result.model, provenance={}))
    colors = "" if result.color is None else f", colors off by {255 * result.color:.1f}/255"
    kind = f"weights of {result.bits:.1f} bits{colors}"
    return ShortWeights(result.model, data, error, kind) if error[0] <= MOST_ERROR else None


@lru_cache(maxsize=1)
def short_weights(model: Model) -> ShortWeights | None:
    """Return a model with short weights; None for scenes, packed weights, or where the error exceeds MOST_ERROR."""
    if model.scene is not None or pack(model.networks()) is not None:
        return None
    coded = {name: _coded(tensor) for name, tensor in model.tensors().items()}
    tensors = {name: _decoded(*numbers) for name, numbers in coded.items()}
    short = replace(
        model,
        levels=tuple(
            replace(level, network=_network(tensors, f"level{i}", level.network))
            for i, level in enumerate(model.levels, start=1)
        ),
        texture=None if model.texture is None else _network(tensors, "texture", model.texture),
    )
    error = rounding_error(model, short)
    return ShortWeights(short, _file(model, coded), error) if error[0] <= MOST_ERROR else None


def _coded(tensor: Array) -> tuple[NDArray[np.integer[Any]], list[float]]:
    """Return a tensor as whole numbers and its step, or a step for each row of a matrix."""
    for rows in (1, len(tensor)) if tensor.ndim == 2 else (1,):
        parts = tensor.reshape(rows, -1)
        steps = [step for part in parts if (step := step_of(part, SMALL))]
        if len(steps) == rows:
            numbers = np.rint(parts / np.array(steps)[:, None]).astype(np.int8).reshape(tensor.shape)
            if np.array_equal(_decoded(numbers, steps), tensor):
                return numbers, steps
    step = float(np.abs(tensor).max()) / LARGE or 1.0
    return np.rint(tensor / step).astype("<i2"), [step]


def _decoded(numbers: NDArray[np.integer[Any]], steps: list[float]) -> Array:
    parts = numbers.reshape(len(steps), -1).astype(np.float64) * np.array(steps)[:, None]
    decoded: Array = parts.reshape(numbers.shape).astype(np.float32)
    return decoded


def _network(tensors: Mapping[str, Array], prefix: str, network: Network) -> Network:
    return tuple(
        Layer(tensors[f"{prefix}.layer{j}.weight"], tensors[f"{prefix}.layer{j}.bias"]) for j in range(len(network))
    )


def _file(model: Model, coded: Mapping[str, tuple[NDArray[np.integer[Any]], list[float]]]) -> bytes:
    """Return the model file, without provenance, with the tensors replaced."""
    exact = to_bytes(replace(model, provenance={}))
    header = json.loads(exact[8 : 8 + int.from_bytes(exact[:8], "little")])
    header["__metadata__"]["steps"] = json.dumps({name: steps for name, (_, steps) in coded.items()})
    at, parts = 0, []
    for name, (numbers, _) in coded.items():
        parts.append(b"".join(plane.tobytes() for plane in np.moveaxis(numbers[..., None].view(np.uint8), -1, 0)[::-1]))
        kind = "I8" if numbers.itemsize == 1 else "I16"
        header[name] = {"dtype": kind, "shape": numbers.shape, "data_offsets": [at, at + len(parts[-1])]}
        at += len(parts[-1])
    text = json.dumps(header, separators=(",", ":")).encode()
    return len(text).to_bytes(8, "little") + text + b"".join(parts)
