"""Runs the functions of a program in numpy, in float32, op by op."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ir.program import INPUT, Affine, Array, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed

Margins = Sequence[float] | Sequence[NDArray[np.float64]]
"""Extra half widths of the bands, see interpret.nested_levels."""


def _biased(products: Array, bias: Array | None) -> Array:
    """Add a bias (width,), if any, to products (N, width), in place: a copy would cost as much as the sum."""
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
"""Kind of op -> function of the op and of a lookup of values (N, width) and constants by name; returns (N, width)."""


def run(program: Program, function: Function, inputs: Array) -> tuple[Array, ...]:
    """Evaluate a function of a program at inputs (N, 4) float32. Returns its outputs, each (N, width) float32."""
    values = {INPUT: inputs}

    def get(name: str) -> Array:
        return values[name] if name in values else program.constants[name]

    for op in function.ops:
        values[op.result] = OPS[type(op)](op, get)
    return tuple(values[name] for name in function.outputs)
