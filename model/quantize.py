"""Quantized weights: integer multiples of a step, which take few characters as text (codegen/printers/packed.py).

- A hidden layer has one step. The weights are multiples of at most `MAX_HIDDEN`, 6 bits with the sign; the biases are
  multiples of any size.
- The first layer's matrix (frequencies) and bias (phases) and each row of the last layer's matrix have a step of their
  own. The multiples are at most `MAX_FINE`, 8 bits with the sign.
- The last layer's bias is any number.

`quantized` quantizes any network. Training can also keep the weights quantized from the first step on
(trainer/networks/quantized.py).
"""

from dataclasses import replace

import numpy as np

from .model import Array, Layer, Model, Network

MAX_HIDDEN = 31
"""Largest multiple in the matrix of a hidden layer."""
MAX_FINE = 127
"""Largest multiple in the first layer, and in the matrix of the last."""
CLIP = 2.0
"""Largest weight of a hidden layer, in standard deviations of its weights.

Larger weights are clipped, because the smaller step improves all other weights.
"""
TOLERANCE = 1e-3
"""Largest distance of a weight from a multiple of its step, in steps."""
FEW = 8
"""Entries of an array that are tried first in the search for its step."""


def step_of(array: Array, largest: int) -> float | None:
    """Find the largest step such that every entry of an array is a multiple of it; None if there is no such step.

    array: float32, any shape. largest: bound on the multiples. An array of zeros has the step 1.
    """
    top = float(np.abs(array).max())
    if not top > 0:
        return 1.0
    steps = np.array([float(f"{top / count:.6g}") for count in range(1, largest + 1)])
    few = array.ravel()[:FEW, None] / steps  # They rule out nearly all steps.
    for step in steps[(np.abs(few - np.rint(few)) < TOLERANCE).all(axis=0)].tolist():
        if are_multiples(array, step):
            return float(step)
    return None


def are_multiples(array: Array, step: float) -> bool:
    """Whether every entry of an array is a multiple of `step`, within `TOLERANCE`."""
    ratio = array.astype(np.float64) / step
    return bool(np.abs(ratio - np.rint(ratio)).max() < TOLERANCE)


def is_quantized(network: Network) -> bool:
    """Whether every layer of a network is quantized."""
    first, *hidden = network[:-1]
    fine = (first.weight, first.bias, *network[-1].weight)
    steps = [step_of(layer.weight, MAX_HIDDEN) for layer in hidden]
    return all(step_of(array, MAX_FINE) is not None for array in fine) and all(
        step is not None and are_multiples(layer.bias, step) for step, layer in zip(steps, hidden, strict=True)
    )


def quantized(network: Network) -> Network:
    """Return the nearest quantized network; the last layer's bias is rounded to five decimals."""
    first, *hidden = network[:-1]
    layers = [Layer(_quantized_finely(first.weight), _quantized_finely(first.bias))]
    for layer in hidden:
        top = min(CLIP * float(layer.weight.std()), float(np.abs(layer.weight).max()))
        step = _three_digits(top / MAX_HIDDEN)
        weight = np.clip(layer.weight, -MAX_HIDDEN * step, MAX_HIDDEN * step)
        layers.append(Layer(_nearest_multiples(weight, step), _nearest_multiples(layer.bias, step)))
    rows = [_quantized_finely(row) for row in network[-1].weight]
    return *layers, Layer(np.stack(rows), network[-1].bias.astype(np.float64).round(5).astype(np.float32))


def quantized_model(model: Model) -> Model:
    """Return the model with all networks quantized. Quantized networks stay the same objects."""
    levels = tuple(replace(level, network=_once_quantized(level.network)) for level in model.levels)
    return replace(model, levels=levels, texture=None if model.texture is None else _once_quantized(model.texture))


def _once_quantized(network: Network) -> Network:
    return network if is_quantized(network) else quantized(network)


def _quantized_finely(array: Array) -> Array:
    step = _three_digits(float(np.abs(array).max()) / MAX_FINE)
    return _nearest_multiples(np.clip(array, -MAX_FINE * step, MAX_FINE * step), step)


def _three_digits(step: float) -> float:
    """Round a step to three digits, for a short text; 0 becomes 1."""
    return float(f"{step:.3g}") or 1.0


def _nearest_multiples(array: Array, step: float) -> Array:
    return (np.rint(array.astype(np.float64) / step) * step).astype(np.float32)
