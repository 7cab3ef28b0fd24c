"""Packed weights: the networks of a model in a few bits for each weight (docs/format.md, version 3).

Each row of a layer has a step, 2^(e/2) with a whole number e. Its weights are multiples of the step, and its bias is a
multiple of a quarter of it. The multiples are written by a range coder, as numbers of a bell whose width is that of the
layer's weights.
"""

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .checks import WIDEST
from .errors import UserError
from .model import Array, Layer, Network
from .range_coder import WIDEST_BELL, Decoder, Encoder, power

BIAS = 4
"""Steps of a bias in a step of the weights."""
MOST = 1 << 17
"""Largest multiple of a weight, and the share of a step that a bias may be larger."""
WEIGHTS_OF_A_BYTE = 8
"""Most weights for each byte, so that a short file does not ask for long work. Writers add zeros."""
MOST_WEIGHTS = 1 << 22
"""Most weights of a file, which takes some five seconds."""
OFFSET = 128
"""Added to exponents from -OFFSET to OFFSET - 1, for writing."""
CHANGE = 0
"""Quarter octaves of the bell of the differences between the exponents of neighboring rows."""

Whole = NDArray[np.int64]
Sizes = list[int]
"""Inputs of a network, then the outputs of each layer."""


def step(exponent: int) -> float:
    """Return 2^(exponent / 2)."""
    return power(2 * exponent)


def sizes_of(network: Network) -> Sizes:
    """Return the inputs of a network and the outputs of each layer."""
    return [network[0].weight.shape[1], *(len(layer.weight) for layer in network)]


def pack(networks: Mapping[str, Network]) -> bytes | None:
    """Return the networks as bytes. `unpack` returns equal weights.

    Returns None if the weights are no multiples of steps, or more than `MOST_WEIGHTS`.
    """
    encoder, count = Encoder(), 0
    if sum(layer.weight.size for network in networks.values() for layer in network) > MOST_WEIGHTS:
        return None
    for network in networks.values():
        for layer in network:
            exponents = _exponents(layer)
            if exponents is None:
                return None
            _write_layer(encoder, layer, exponents)
            count += layer.weight.size
    data = encoder.finish()
    return data.ljust(-(-count // WEIGHTS_OF_A_BYTE), b"\0")


def unpack(sizes: Mapping[str, object], data: bytes) -> dict[str, Array]:
    """Return the tensors of the networks with these `Sizes`, by their names in a file. Raises UserError."""
    count = 0
    for prefix, widths in sizes.items():
        if (
            not isinstance(widths, list)
            or len(widths) < 3
            or not all(type(width) is int and 1 <= width <= WIDEST for width in widths)
        ):
            raise UserError(f"packed: {prefix}: not the sizes of a network's layers, each from 1 to {WIDEST}")
        count += sum(a * b for a, b in pairwise(widths))
    if count > WEIGHTS_OF_A_BYTE * len(data):
        raise UserError(f"packed: {count} weights in {len(data)} bytes; the file is cut short or damaged")
    if count > MOST_WEIGHTS:
        raise UserError(f"packed: {count:,} weights; at most {MOST_WEIGHTS:,} are read")
    tensors = {}
    try:
        decoder = Decoder(data)
        for prefix, widths in sizes.items():
            assert isinstance(widths, list)
            for j, (columns, rows) in enumerate(pairwise(widths)):
                name = f"{prefix}.layer{j}"
                tensors[f"{name}.weight"], tensors[f"{name}.bias"] = _read_layer(decoder, rows, columns)
        decoder.finish()
    except EOFError:
        raise UserError("packed: the file is cut short or damaged") from None
    return tensors


def _write_layer(encoder: Encoder, layer: Layer, exponents: Whole) -> None:
    steps = np.array([step(int(exponent)) for exponent in exponents])
    weights = np.rint(layer.weight / steps[:, None]).astype(np.int64)
    biases = np.rint(BIAS * layer.bias.astype(np.float64) / steps).astype(np.int64)
    width, bias_width = _quarters(layer.weight), _quarters(layer.bias) + 8
    for number in (width, bias_width, int(exponents[0])):
        encoder.plain(number + OFFSET, 2 * OFFSET)
    for change in np.diff(exponents):
        encoder.number(int(change), CHANGE)
    for row, bias, exponent in zip(weights.tolist(), biases.tolist(), exponents.tolist(), strict=True):
        for weight in row:
            encoder.number(weight, width - 2 * exponent)
        encoder.number(bias, bias_width - 2 * exponent)


def _read_layer(decoder: Decoder, rows: int, columns: int) -> tuple[Array, Array]:
    """Return a layer's weight and bias. Raises EOFError, UserError."""
    width, bias_width, exponent = (decoder.plain(2 * OFFSET) - OFFSET for _ in range(3))
    exponents = [exponent]
    for _ in range(rows - 1):
        exponent += decoder.number(CHANGE)
        exponents.append(exponent)
    if max(map(abs, exponents)) > OFFSET or max(width, bias_width) - 2 * min(exponents) > WIDEST_BELL:
        raise UserError("packed: a step is out of its range; the file is damaged")
    weight, bias = np.empty((rows, columns)), np.empty(rows)
    for i, exponent in enumerate(exponents):
        weight[i] = [decoder.number(width - 2 * exponent) for _ in range(columns)]
        weight[i] *= step(exponent)
        bias[i] = decoder.number(bias_width - 2 * exponent) * (step(exponent) / BIAS)
    return weight.astype(np.float32), bias.astype(np.float32)


def _exponents(layer: Layer) -> Whole | None:
    """Return the exponent of each row's step; None if a row has none."""
    found = []
    for row, bias in zip(layer.weight, layer.bias, strict=True):
        values = np.append(row, np.float32(BIAS) * bias).astype(np.float64)
        largest = float(np.abs(row).max()) or float(np.abs(values).max())
        exponent = math.floor(2 * math.log2(largest)) if largest else 0
        least = exponent - 2 * round(math.log2(MOST))
        while exponent >= least and not _fits(values, step(exponent)):
            exponent -= 1
        if exponent < max(least, -OFFSET) or exponent >= OFFSET:
            return None
        found.append(exponent)
    exponents = np.array(found)
    widest = max(_quarters(layer.weight), _quarters(layer.bias) + 8) - 2 * int(exponents.min())
    return None if widest > WIDEST_BELL else exponents


def _fits(values: NDArray[np.float64], size: float) -> bool:
    """Whether 32-bit values are multiples of a step, below what `Encoder.number` writes."""
    multiples = np.rint(values / size)
    return bool(np.abs(multiples).max() < MOST * 16 and ((multiples * size).astype(np.float32) == values).all())


def _quarters(values: Array) -> int:
    """Return four times the logarithm of the root mean square, as a whole number."""
    size = math.sqrt(float(np.mean(np.square(values, dtype=np.float64))))
    return max(-OFFSET, min(OFFSET - 9, round(4 * math.log2(size)))) if size else -OFFSET
