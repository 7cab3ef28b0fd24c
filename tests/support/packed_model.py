"""A small model whose weights are multiples of steps, as packed files hold them."""

from dataclasses import replace

import numpy as np

from mplicits.model.model import Layer, Model, Network
from mplicits.model.packed_weights import BIAS, step


def packed_network(network: Network, rng: np.random.Generator) -> Network:
    """Round a network: a random step for each row, from fine to coarse."""
    layers = []
    for layer in network:
        steps = np.array([step(int(e)) for e in rng.integers(-22, -6, len(layer.weight))])
        weight = np.rint(layer.weight / steps[:, None]) * steps[:, None] + 0.0  # no -0
        bias = np.rint(BIAS * layer.bias / steps) * (steps / BIAS) + 0.0
        layers.append(Layer(weight.astype(np.float32), bias.astype(np.float32)))
    return tuple(layers)


def packed_model(model: Model, seed: int = 0) -> Model:
    """Round all networks of a model of one shape."""
    rng = np.random.default_rng(seed)
    levels = tuple(replace(level, network=packed_network(level.network, rng)) for level in model.levels)
    texture = None if model.texture is None else packed_network(model.texture, rng)
    return replace(model, levels=levels, texture=texture)
