"""Runs a program in numpy, float32: the definition of every op. Targets are tested against it."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ir.program import INPUT, Affine, Array, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed

OPS: dict[type[Op], Callable[[Any, Callable[[str], Array]], Array]] = {
    Affine: lambda op, get: get(op.source) @ get(op.matrix).T + (0 if op.bias is None else get(op.bias)),
    Transposed: lambda op, get: get(op.source) @ get(op.matrix),
    Sine: lambda op, get: np.sin(get(op.source)),
    Cosine: lambda op, get: np.cos(get(op.source)),
    Product: lambda op, get: get(op.left) * get(op.right),
    Dot: lambda op, get: np.float32(op.scale) * (get(op.source) @ get(op.row))[:, None] + np.float32(op.bias),
    Scale: lambda op, get: np.float32(op.factor) * get(op.source),
}
"""Op -> result (N, width) from the values (N, width) and constants that its names stand for."""


def run(program: Program, function: Function, inputs: Array) -> tuple[Array, ...]:
    """Outputs (N, width) of `function` at inputs: (N, 4) float32."""
    values = {INPUT: inputs}

    def get(name: str) -> Array:
        return values[name] if name in values else program.constants[name]

    for op in function.ops:
        values[op.result] = OPS[type(op)](op, get)
    return tuple(values[name] for name in function.outputs)


def field(program: Program, points: Array, level: int, time: float = 0.0) -> Array:
    """f_level (N,) at points (N, 3) float32, model space."""
    inputs = _inputs(program, points, time)
    total: Array = sum(
        (run(program, function, inputs)[0][:, 0] for function in program.values[:level]), np.zeros(1, np.float32)
    )
    return total


def field_gradient(program: Program, points: Array, level: int, time: float = 0.0) -> tuple[Array, Array]:
    """Gradient (N, 3) and value (N,) of f_level at points (N, 3) float32, model space."""
    inputs = _inputs(program, points, time)
    results = [run(program, function, inputs) for function in program.gradients[:level]]
    gradient: Array = sum((gradient[:, :3] for gradient, _ in results), np.zeros(1, np.float32))
    value: Array = sum((value[:, 0] for _, value in results), np.zeros(1, np.float32))
    return gradient, value


def nested_field(program: Program, points: Array, level: int, time: float = 0.0) -> tuple[Array, NDArray[np.int64]]:
    """Value (N,) of the finest level that is defined at each point, and that level (N,), up to `level`.

    Level i + 1 is defined where |f_i| < delta_i (Eq. 3); outside, f_i is the answer.
    """
    inputs = _inputs(program, points, time)
    value = run(program, program.values[0], inputs)[0][:, 0]
    reached = np.ones(len(points), np.int64)
    for i in range(1, level):
        inside = np.flatnonzero((reached == i) & (np.abs(value) < program.bands[i - 1].delta))
        value[inside] += run(program, program.values[i], inputs[inside])[0][:, 0]
        reached[inside] = i + 1
    return value, reached


def colour(program: Program, points: Array, time: float = 0.0) -> Array:
    """Colour (N, 3), sRGB in [0, 1], at points (N, 3) float32, model space. Raises ValueError without a texture."""
    if program.texture is None:
        raise ValueError("the model has no texture")
    return np.clip(np.concatenate(run(program, program.texture, _inputs(program, points, time)), axis=1), 0, 1)


def _inputs(program: Program, points: Array, time: float) -> Array:
    fourth = np.full((len(points), 1), time if program.moving else 1.0, np.float32)
    return np.concatenate([points.astype(np.float32), fourth], axis=1)
