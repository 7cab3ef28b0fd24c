"""Small models with the random weights of an untrained SIREN."""

import itertools

import numpy as np

from mplicits.model.model import Layer, Level, Model, Network


def random_network(width: int, depth: int, rng: np.random.Generator, outputs: int = 1, inputs: int = 3) -> Network:
    """Draw a network of size (width, depth) in the paper's notation, with SIREN's initialization for omega_0 = 10."""
    sizes = [inputs, *[width] * (depth + 1), outputs]
    layers = []
    for j, (columns, rows) in enumerate(itertools.pairwise(sizes)):
        bound = 10 / columns if j == 0 else np.sqrt(6 / columns)
        weight = rng.uniform(-bound, bound, (rows, columns)).astype(np.float32)
        layers.append(Layer(weight, rng.uniform(-1, 1, rows).astype(np.float32)))
    return tuple(layers)


def random_model(
    *shapes: tuple[int, int],
    texture: tuple[int, int] | None = None,
    name: str = "random",
    seed: int = 0,
    inputs: str = "xyz",
) -> Model:
    """Draw a model with a level for each (width, depth), and bands wide enough that every level is reached."""
    rng = np.random.default_rng(seed)
    levels = [
        Level(random_network(*shape, rng, inputs=len(inputs)), delta=1.0 / i, iterations=20 if i == 1 else 5)
        for i, shape in enumerate(shapes, start=1)
    ]
    colors = None if texture is None else random_network(*texture, rng, outputs=3, inputs=len(inputs))
    return Model(name, tuple(levels), colors, inputs=inputs)
