"""Compares two ways to round the weights of the gallery's models for Shadertoy: writes docs/results/rounding.md.

    python benchmarks/rounding.py [-o FILE]

Both have the same steps and the same bits. One rounds each weight by itself; the other, that of `bake`, lets weights
make up for the rounding of others.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from mplicits.codegen.targets.shadertoy import WIDEST
from mplicits.field.bits import cost, fewest_bits
from mplicits.model import gallery
from mplicits.model.model import Array, Layer, Model, Network
from mplicits.model.model_file import load
from mplicits.model.quantise import step_of
from protocol import Page, machine

LARGEST = 2047
"""Largest multiple of its step that a packed weight is."""


def nearest(model: Model, packed: Model) -> Model:
    """Return a model with each weight rounded to the nearest multiple of its step in `packed`."""
    levels = (
        replace(level, network=_nearest(level.network, other.network))
        for level, other in zip(model.levels, packed.levels, strict=True)
    )
    texture = model.texture and packed.texture and _nearest(model.texture, packed.texture)
    return replace(model, levels=tuple(levels), texture=texture)


def _nearest(network: Network, packed: Network) -> Network:
    """Round a network; its last bias, which may be any number, stays as it is."""
    pairs = list(zip(network, packed, strict=True))
    layers = []
    for j, (layer, other) in enumerate(pairs[:-1]):
        bias = _multiples(layer.bias, other.weight if j else other.bias, other.bias)
        layers.append(Layer(_multiples(layer.weight, other.weight, other.weight), bias))
    last, like = pairs[-1]
    rows = [_multiples(row, other, other) for row, other in zip(last.weight, like.weight, strict=True)]
    return *layers, Layer(np.stack(rows), last.bias)


def _multiples(array: Array, stepped: Array, bounds: Array) -> Array:
    """Round an array to the nearest multiples of the step of `stepped`, none larger than the largest of `bounds`."""
    step, largest = step_of(stepped, LARGEST) or 1.0, np.abs(bounds).max()
    return (np.rint(array.astype(np.float64) / step) * step).clip(-largest, largest).astype(np.float32)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/rounding.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# Weights of few bits, rounded in two ways",
        "",
        "Printed by `python benchmarks/rounding.py`: models of the gallery with the bits that `bake --target "
        "shadertoy` gives them. Nearest: each weight at the nearest multiple of its step. Made up for: the same steps, "
        "each rounding undone by the weights that are still free, as `bake` does it. Root mean square and largest "
        "abs(f - f rounded) near the surface of the last level (model units; the shape has radius 1), angle between "
        "normals, colours of 255, on points that the rounding did not see.",
        "",
        f"{machine()}.",
        "",
        "| model | weights | f off by | largest | normals, degrees | colours |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    )
    for name in gallery.names():
        model = load(gallery.model_path(name))
        if max(layer.weight.shape[0] for network in model.networks().values() for layer in network) > WIDEST:
            continue
        packed = fewest_bits(model)
        assert packed is not None
        for way, rounded in (("nearest", nearest(model, packed)), ("made up for", packed)):
            paid = cost(model, rounded)
            page.add(
                f"| {name} | {way} | {paid.distance:.1e} | {paid.largest:.1e} | {paid.angle:.2f} | {paid.colour:.1f} |"
            )


if __name__ == "__main__":
    main()
