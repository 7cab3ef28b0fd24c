"""The NumPy interpreter of programs (ir/program.py), in float32: the definition that every target is tested against."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from . import composed
from .run import Margins, run


def field(program: Program, points: Array, level: int, time: float = 0.0) -> Array:
    """Evaluate the sum f_level at points (N, 3) float32, model space, also outside the bands. Returns (N,) float32.

    level: from 1. time: the fourth input of a moving model.
    """
    if program.composition is not None:
        return composed.field(program, points, level, time)
    inputs = _inputs(program, points, time)
    total: Array = sum(
        (run(program, function, inputs)[0][:, 0] for function in program.values[:level]), np.zeros(1, np.float32)
    )
    return total


def field_gradient(program: Program, points: Array, level: int, time: float = 0.0) -> tuple[Array, Array]:
    """Evaluate the gradient of f_level, (N, 3) float32, and its value, (N,). Arguments as for `field`."""
    if program.composition is not None:
        return composed.field_gradient(program, points, level, time)
    inputs = _inputs(program, points, time)
    results = [run(program, function, inputs) for function in program.gradients[:level]]
    gradient: Array = sum((gradient[:, :3] for gradient, _ in results), np.zeros(1, np.float32))
    value: Array = sum((value[:, 0] for _, value in results), np.zeros(1, np.float32))
    return gradient, value


def nested_levels(
    program: Program, points: Array, level: int, time: float = 0.0, margins: Margins | None = None
) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """Evaluate each nested level at the points where it is defined; defines Eq. 3.

    Level 1 is defined everywhere. Level i + 1 is defined where level i is and |f_i| < delta_i + margins[i - 1], and
    f_{i+1} = f_i + r_i.

    points: (N, 3) float32, model space. level: the last level. time: the fourth input of a moving model. margins: extra
    half width of each band before the last, in the unit of f, None for 0; except for scenes, also an array (N,) each.
    Yields for each level, coarsest first, the indices (M,) of the points where it is defined, and f there (M,).
    """
    if program.composition is not None:
        yield from composed.nested_levels(program, points, level, time, margins)
        return
    inputs = _inputs(program, points, time)
    defined = np.arange(len(points))
    value = np.zeros(len(points), np.float32)
    for i, function in enumerate(program.values[:level]):
        residual = run(program, function, inputs[defined])[0][:, 0]
        value = residual if i == 0 else value + residual
        yield defined, value
        if i + 1 < level:
            margin = 0.0 if margins is None else margins[i]
            margin = margin[defined] if isinstance(margin, np.ndarray) else margin
            inside = np.abs(value) < program.bands[i].delta + margin
            defined, value = defined[inside], value[inside]


def nested_field(
    program: Program, points: Array, level: int, time: float = 0.0, margins: Margins | None = None
) -> tuple[Array, NDArray[np.int64]]:
    """Evaluate the finest level that is defined at each point: its value (N,) float32, and its number (N,).

    Arguments as for `nested_levels`.
    """
    value, reached = np.zeros(len(points), np.float32), np.zeros(len(points), np.int64)
    for number, (defined, f) in enumerate(nested_levels(program, points, level, time, margins), start=1):
        value[defined], reached[defined] = f, number
    return value, reached


def color(program: Program, points: Array, time: float = 0.0) -> Array:
    """Evaluate the color at points (N, 3) float32, model space: (N, 3) float32, sRGB in [0, 1].

    Raises ValueError for a model without a texture.
    """
    if program.composition is not None:
        return composed.color(program, points, time)
    if program.texture is None:
        raise ValueError("the model has no texture")
    return np.clip(np.concatenate(run(program, program.texture, _inputs(program, points, time)), axis=1), 0, 1)


def _inputs(program: Program, points: Array, time: float) -> Array:
    fourth = np.full((len(points), 1), time if program.moving else 1.0, np.float32)
    return np.concatenate([points.astype(np.float32), fourth], axis=1)
