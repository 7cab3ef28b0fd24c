"""Checks of a model's values. Each raises UserError, one line that begins with the wrong tensor or key."""

import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .endings import SHAPES
from .errors import UserError
from .files import show

DEEPEST, LARGEST = 64, 1e300
"""Largest depth of JSON, and bound of its numbers."""
WIDEST = 4096
"""Largest number of outputs of a layer."""

_SMALLEST, _LARGEST = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)
_TYPE_NAMES = {str: "a text", list: "a list", dict: "an object of keys and values", int: "a whole number"}


def shape_hint(path: Path) -> str | None:
    """Tell the user to train a model from a file with a shape; None for files with another suffix."""
    kind = SHAPES.get(path.suffix.lower())
    if kind is None:
        return None
    name = show(f"./{path}" if str(path).startswith("-") else path)
    return f"{kind}; train it with: mplicits train {shlex.quote(name)}"


def check_keys(where: str, value: object, keys: Mapping[str, type]) -> None:
    """Check the keys of a JSON object and the types of their values.

    where: the start of the message. keys: required key -> type; float means a finite number. Other keys are allowed.
    """
    if not isinstance(value, dict):
        raise UserError(f"{where}: is not {_TYPE_NAMES[dict]}")
    for key, kind in keys.items():
        if key not in value:
            raise UserError(f"{where}: key '{key}' is missing")
        if kind is float:
            check_finite(f"{where}: '{key}'", value[key])
        elif type(value[key]) is not kind:
            raise UserError(f"{where}: '{key}' is not {_TYPE_NAMES[kind]}")


def check_json(key: str, value: object) -> None:
    """Check that a value is a dict that JSON can store, without NaN, infinity, huge numbers or deep nesting."""
    if not isinstance(value, dict):
        raise UserError(f"{key}: is not {_TYPE_NAMES[dict]}")
    layer: list[object] = [value]
    for _ in range(DEEPEST):
        layer = [each for outer in layer if isinstance(outer, (dict, list, tuple)) for each in _items(outer)]
        for number in (each for each in layer if isinstance(each, (int, float))):
            if not abs(number) < LARGEST:
                raise UserError(f"{key}: has a number that is too large, or not finite")
    if layer:
        raise UserError(f"{key}: is nested more than {DEEPEST} deep")
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise UserError(f"{key}: cannot be stored as JSON ({error})") from None


def _items(value: dict[Any, Any] | list[Any] | tuple[Any, ...]) -> Iterable[Any]:
    return value.values() if isinstance(value, dict) else value


def check_finite(key: str, value: object) -> None:
    """Check that a value is a number in the range of float32: not NaN, not infinite, not too large."""
    # Unlike math.isfinite, the comparison accepts integers of any size. NaN fails it, too.
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= _LARGEST:
        raise UserError(f"{key}: must be a finite number")


def check_positive(key: str, value: float) -> None:
    """Check that a value is a finite number and positive in float32."""
    check_finite(key, value)
    if value < _SMALLEST:
        raise UserError(f"{key}: must be positive")


def check_network(
    prefix: str, layers: Sequence[tuple[NDArray[np.float32], NDArray[np.float32]]], inputs: int, outputs: int
) -> None:
    """Check that layers form a network from `inputs` numbers to `outputs` numbers.

    prefix: start of the tensors' names. layers: at least two pairs of a weight (out, in) and a bias (out,), finite
    float32, with at most `WIDEST` outputs.
    """
    if len(layers) < 2:
        raise UserError(f"{prefix}: needs at least two layers (layer0, layer1)")
    width = inputs
    for j, (weight, bias) in enumerate(layers):
        name = f"{prefix}.layer{j}"
        for key, tensor in (("weight", weight), ("bias", bias)):
            if not isinstance(tensor, np.ndarray) or tensor.dtype != np.float32:
                raise UserError(f"{name}.{key}: must be float32")
            if not np.isfinite(tensor).all():
                raise UserError(f"{name}.{key}: has values that are not finite")
        if weight.ndim != 2 or weight.shape[1] != width:
            raise UserError(f"{name}.weight: shape {weight.shape}, expected (out, {width})")
        width = weight.shape[0]
        if not 1 <= width <= WIDEST:
            raise UserError(f"{name}.weight: {width} outputs, expected 1 to {WIDEST}")
        if j == len(layers) - 1 and width != outputs:
            raise UserError(f"{name}.weight: {width} outputs, expected {outputs}")
        if bias.shape != (width,):
            raise UserError(f"{name}.bias: shape {bias.shape}, expected ({width},)")
