"""A moment of a model that moves, as a static model. Imported by other scripts."""

from dataclasses import replace

import numpy as np

from mplicits.model.model import Layer, Model, Network


def frozen(model: Model, moment: float) -> Model:
    """Return the static model that a moving one is at a time."""

    def still(network: Network) -> Network:
        first = network[0]
        bias = np.asarray(first.bias + first.weight[:, 3] * np.float32(moment), np.float32)
        return (Layer(np.ascontiguousarray(first.weight[:, :3]), bias), *network[1:])

    levels = tuple(replace(level, network=still(level.network)) for level in model.levels)
    texture = None if model.texture is None else still(model.texture)
    return replace(model, levels=levels, texture=texture, inputs="xyz")
