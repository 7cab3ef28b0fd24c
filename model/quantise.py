"""Weights on a grid: small whole multiples of a step, which take few characters as text (codegen/printers/packed.py).

A hidden layer has one step for its matrix, whose multiples are of 6 bits, and its bias. The first layer, whose matrix
holds frequencies and whose bias phases, has one for each, and every output row has its own; these are of 8 bits.
Training keeps to grids from its first step on (trainer/networks/rounding.py); `rounded` puts any network there.
"""

from dataclasses import replace

import numpy as np

from .model import Array, Layer, Model, Network

HIDDEN, FINE = 31, 127
"""Largest multiples of a hidden layer's matrix, and of all else but hidden biases, which may have any."""
CLIP = 2.0
"""Largest weight of a hidden layer, in standard deviations: rounding all others more finely is worth it."""
TOLERANCE = 1e-3
"""Of a step, from a whole multiple."""


def step_of(array: Array, largest: int) -> float | None:
    """The largest step of which every entry is a multiple, `largest` at most; None where there is none."""
    top = float(np.abs(array).max())
    counts = np.arange(1, largest + 1)
    for count in counts if top > 0 else ():
        step = float(f"{top / count:.6g}")
        if multiples(array, step):
            return step
    return None if top > 0 else 1.0


def multiples(array: Array, step: float) -> bool:
    """Whether every entry is a multiple of `step`."""
    ratio = array.astype(np.float64) / step
    return bool(np.abs(ratio - np.rint(ratio)).max() < TOLERANCE)


def on_grid(network: Network) -> bool:
    """Whether every layer is on its grid."""
    first, *hidden = network[:-1]
    fine = (first.weight, first.bias, *network[-1].weight)
    steps = [step_of(layer.weight, HIDDEN) for layer in hidden]
    return all(step_of(array, FINE) is not None for array in fine) and all(
        step is not None and multiples(layer.bias, step) for step, layer in zip(steps, hidden, strict=True)
    )


def rounded(network: Network) -> Network:
    """The nearest network on a grid, its output's bias to five decimals."""
    first, *hidden = network[:-1]
    layers = [Layer(_finely(first.weight), _finely(first.bias))]
    for layer in hidden:
        most = min(CLIP * float(layer.weight.std()), float(np.abs(layer.weight).max()))
        step = _short(most / HIDDEN)
        weight = np.clip(layer.weight, -HIDDEN * step, HIDDEN * step)
        layers.append(Layer(_nearest(weight, step), _nearest(layer.bias, step)))
    rows = [_finely(row) for row in network[-1].weight]
    return *layers, Layer(np.stack(rows), network[-1].bias.astype(np.float64).round(5).astype(np.float32))


def rounded_model(model: Model) -> Model:
    """The model with every network on its grid; those that are there already stay as they are."""
    levels = tuple(replace(level, network=_settled(level.network)) for level in model.levels)
    return replace(model, levels=levels, texture=None if model.texture is None else _settled(model.texture))


def _settled(network: Network) -> Network:
    return network if on_grid(network) else rounded(network)


def _finely(array: Array) -> Array:
    step = _short(float(np.abs(array).max()) / FINE)
    return _nearest(np.clip(array, -FINE * step, FINE * step), step)


def _short(step: float) -> float:
    return float(f"{step:.3g}") or 1.0


def _nearest(array: Array, step: float) -> Array:
    return (np.rint(array.astype(np.float64) / step) * step).astype(np.float32)
