"""Lowers a model to a program.

Sizes are padded to multiples of 4, the first layer's bias becomes the matrix column for the input's 1, and each
network's gradient becomes an adjoint pass.
"""

import math

import numpy as np

from ..model.model import Model, Network
from .lower_scene import bands, lower_scene, padded_networks
from .program import INPUT, Affine, Array, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed


def lower(model: Model, digits: int | None = None, padded: bool = True) -> Program:
    """Return the program of a model.

    digits: decimals of the weights, None for exact weights. A row of the last layer is divided by a power of ten before
    it is rounded, and multiplied again by Dot's scale, because its weights are small. padded: pad the widths of a
    scene's networks, as printers/networks.py requires.
    """
    if model.scene is not None:
        shapes = map(padded_networks, model.shapes) if padded else model.shapes
        return lower_scene(model, [lower(shape, digits) for shape in shapes])
    moving = model.inputs == "xyzt"
    constants: dict[str, Array] = {}
    values, gradients, texture = [], [], None
    for i, level in enumerate(model.levels, start=1):
        network = _Lowered(f"{i}", level.network, moving, digits)
        constants |= network.constants
        values.append(Function(f"network{i}", tuple(network.forward()), ("f",)))
        gradients.append(Function(f"network{i}_gradient", tuple(network.with_gradient()), ("gradient", "f")))
    if model.texture is not None:
        network = _Lowered("t", model.texture, moving, digits)
        constants |= network.constants
        channels = ("r", "g", "b")
        texture = Function("network_texture", tuple(network.forward(channels)), channels)
    return Program(
        name=model.name,
        sha256=model.sha256(),
        constants=constants,
        moving=moving,
        bands=bands(model),
        values=tuple(values),
        gradients=tuple(gradients),
        texture=texture,
    )


class _Lowered:
    """One network's constants, and the ops that evaluate it.

    key: suffix of the constants' names: the level's number, or "t" for the texture.
    """

    def __init__(self, key: str, network: Network, moving: bool, digits: int | None) -> None:
        self.key = key
        self.last = len(network) - 2
        """Index of the last hidden layer."""
        self.constants: dict[str, Array] = {}
        for j, layer in enumerate(network[:-1]):
            weight, bias = layer.weight, layer.bias
            if j == 0 and not moving:
                weight = np.concatenate([weight, bias[:, None]], axis=1)
            else:
                self.constants[f"b{key}_{j}"] = _rounded(_padded(bias), digits)
            self.constants[f"w{key}_{j}"] = _rounded(_padded(weight), digits)
        self.outputs: list[tuple[str, float, float]] = []
        """For each output: the name of its row, and the scale and bias of its Dot."""
        for c, (row, bias) in enumerate(zip(network[-1].weight, network[-1].bias.tolist(), strict=True)):
            scale = 1.0 if digits is None else output_scale(row)
            self.constants[f"o{key}_{c}"] = _rounded(_padded((row / scale).astype(np.float32)), digits)
            self.outputs.append((f"o{key}_{c}", scale, bias if digits is None else round(bias, digits + 2)))

    def forward(self, names: tuple[str, ...] = ("f",)) -> list[Op]:
        """Return the ops of the network's outputs `names`: a sine after every layer but the last (Eq. 2)."""
        ops: list[Op] = []
        source = INPUT
        for j in range(self.last + 1):
            name = f"b{self.key}_{j}"
            bias = name if name in self.constants else None
            ops.append(Affine(f"a{j}", source, f"w{self.key}_{j}", bias))
            ops.append(Sine(f"h{j}", f"a{j}"))
            source = f"h{j}"
        for name, (row, scale, offset) in zip(names, self.outputs, strict=True):
            ops.append(Dot(name, source, row, scale, offset))
        return ops

    def with_gradient(self) -> list[Op]:
        """Return the ops of value "f" and "gradient", by the adjoint: g = (g * cos a_j) W_j, from the output back.

        The gradient costs one matrix product per layer more than the value.
        """
        ops = self.forward()
        row, scale, _ = self.outputs[0]
        adjoint = row
        for j in range(self.last, -1, -1):
            ops.append(Cosine(f"c{j}", f"a{j}"))
            ops.append(Product(f"g{j}", adjoint, f"c{j}"))
            adjoint = f"e{j}" if j or scale != 1.0 else "gradient"
            ops.append(Transposed(adjoint, f"g{j}", f"w{self.key}_{j}"))
        if scale != 1.0:
            ops.append(Scale("gradient", adjoint, scale))
        return ops


def output_scale(row: Array) -> float:
    """Return the power of ten that divides a row (n,) of the last layer before it is rounded."""
    largest = float(np.abs(row).max())
    return 10.0 ** math.floor(math.log10(largest)) if largest > 0 else 1.0


def _padded(array: Array) -> Array:
    """Zero-pad every side to a multiple of 4."""
    return np.pad(array, [(0, -size % 4) for size in array.shape])


def _rounded(array: Array, digits: int | None) -> Array:
    return array if digits is None else np.round(array.astype(np.float64), digits).astype(np.float32)
