"""Runs programs in numpy, in float32: what codegen/ir/program.py says, as code. Every target is tested against it."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ir.program import INPUT, Affine, Array, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed


def _biased(products: Array, bias: Array | None) -> Array:
    """Add a bias (width,), where there is one, to products (N, width), in place: memory costs as much as sums here."""
    if bias is not None:
        products += bias
    return products


OPS: dict[type[Op], Callable[[Any, Callable[[str], Array]], Array]] = {
    Affine: lambda op, get: _biased(get(op.source) @ get(op.matrix).T, None if op.bias is None else get(op.bias)),
    Transposed: lambda op, get: get(op.source) @ get(op.matrix),
    Sine: lambda op, get: np.sin(get(op.source)),
    Cosine: lambda op, get: np.cos(get(op.source)),
    Product: lambda op, get: get(op.left) * get(op.right),
    Dot: lambda op, get: np.float32(op.scale) * (get(op.source) @ get(op.row))[:, None] + np.float32(op.bias),
    Scale: lambda op, get: np.float32(op.factor) * get(op.source),
}
"""Kind of op -> function of an op, and of another that gives the value (N, width) or the constant of a name.

It returns the op's result, (N, width).
"""


def run(program: Program, function: Function, inputs: Array) -> tuple[Array, ...]:
    """Evaluate a function of a program. inputs: (N, 4) float32. Returns its outputs, each (N, width) float32."""
    values = {INPUT: inputs}

    def get(name: str) -> Array:
        return values[name] if name in values else program.constants[name]

    for op in function.ops:
        values[op.result] = OPS[type(op)](op, get)
    return tuple(values[name] for name in function.outputs)


def field(program: Program, points: Array, level: int, time: float = 0.0) -> Array:
    """Evaluate f_level, whether or not that level is defined at the points.

    points: (N, 3) float32, model space. level: counted from 1. time: the fourth input of a model that moves. Returns
    (N,) float32.
    """
    inputs = _inputs(program, points, time)
    total: Array = sum(
        (run(program, function, inputs)[0][:, 0] for function in program.values[:level]), np.zeros(1, np.float32)
    )
    return total


def field_gradient(program: Program, points: Array, level: int, time: float = 0.0) -> tuple[Array, Array]:
    """Evaluate the gradient of f_level, (N, 3) float32, and its value, (N,). Takes what `field` takes."""
    inputs = _inputs(program, points, time)
    results = [run(program, function, inputs) for function in program.gradients[:level]]
    gradient: Array = sum((gradient[:, :3] for gradient, _ in results), np.zeros(1, np.float32))
    value: Array = sum((value[:, 0] for _, value in results), np.zeros(1, np.float32))
    return gradient, value


def nested_levels(
    program: Program, points: Array, level: int, time: float = 0.0, margins: Sequence[float] | None = None
) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """Evaluate the nested levels, each at the points where it is defined (Eq. 3).

    Level 1 is defined everywhere. Level i + 1 is defined where level i is and |f_i| < delta_i + margins[i - 1], and
    f_{i+1} = f_i + r_i.

    points: (N, 3) float32, model space. level: the last one that is evaluated. time: the fourth input of a model that
    moves. margins: how far each band is widened, in the unit of f, for every level before the last; None for not at
    all. Yields for each level, the coarsest first, the indices (M,) of the points where it is defined and f there (M,).
    """
    inputs = _inputs(program, points, time)
    defined = np.arange(len(points))
    value = np.zeros(len(points), np.float32)
    for i, function in enumerate(program.values[:level]):
        residual = run(program, function, inputs[defined])[0][:, 0]
        value = residual if i == 0 else value + residual
        yield defined, value
        if i + 1 < level:
            inside = np.abs(value) < program.bands[i].delta + (0.0 if margins is None else margins[i])
            defined, value = defined[inside], value[inside]


def nested_field(
    program: Program, points: Array, level: int, time: float = 0.0, margins: Sequence[float] | None = None
) -> tuple[Array, NDArray[np.int64]]:
    """Evaluate the finest level that is defined at each point, up to `level`.

    Takes what `nested_levels` takes. Returns the value (N,) float32 of that level at each point, and its number (N,).
    """
    value, reached = np.zeros(len(points), np.float32), np.zeros(len(points), np.int64)
    for number, (defined, f) in enumerate(nested_levels(program, points, level, time, margins), start=1):
        value[defined], reached[defined] = f, number
    return value, reached


def colour(program: Program, points: Array, time: float = 0.0) -> Array:
    """Evaluate the colour at points (N, 3) float32, model space.

    Returns (N, 3) float32, sRGB in [0, 1]. Raises ValueError where the model has no texture.
    """
    if program.texture is None:
        raise ValueError("the model has no texture")
    return np.clip(np.concatenate(run(program, program.texture, _inputs(program, points, time)), axis=1), 0, 1)


def _inputs(program: Program, points: Array, time: float) -> Array:
    """Return the inputs (N, 4) of the program's functions at points (N, 3)."""
    fourth = np.full((len(points), 1), time if program.moving else 1.0, np.float32)
    return np.concatenate([points.astype(np.float32), fourth], axis=1)
