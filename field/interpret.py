"""Runs programs in numpy, in float32: what ir/program.py says, as code. Every target is tested against it."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from . import composed
from .run import Margins, run


def field(program: Program, points: Array, level: int, time: float = 0.0) -> Array:
    """Evaluate f_level, whether or not that level is defined at the points.

    points: (N, 3) float32, model space. level: counted from 1. time: the fourth input of a model that moves. Returns
    (N,) float32.
    """
    if program.composition is not None:
        return composed.field(program, points, level, time)
    inputs = _inputs(program, points, time)
    total: Array = sum(
        (run(program, function, inputs)[0][:, 0] for function in program.values[:level]), np.zeros(1, np.float32)
    )
    return total


def field_gradient(program: Program, points: Array, level: int, time: float = 0.0) -> tuple[Array, Array]:
    """Evaluate the gradient of f_level, (N, 3) float32, and its value, (N,). Takes what `field` takes."""
    if program.composition is not None:
        return composed.field_gradient(program, points, level, time)
    inputs = _inputs(program, points, time)
    results = [run(program, function, inputs) for function in program.gradients[:level]]
    gradient: Array = sum((gradient[:, :3] for gradient, _ in results), np.zeros(1, np.float32))
    value: Array = sum((value[:, 0] for _, value in results), np.zeros(1, np.float32))
    return gradient, value


def nested_levels(
    program: Program,
    points: Array,
    level: int,
    time: float = 0.0,
    margins: Margins | None = None,
) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """Evaluate the nested levels, each at the points where it is defined (Eq. 3).

    Level 1 is defined everywhere. Level i + 1 is defined where level i is and |f_i| < delta_i + margins[i - 1], and
    f_{i+1} = f_i + r_i.

    points: (N, 3) float32, model space. level: the last one that is evaluated. time: the fourth input of a model that
    moves. margins: how far each band is widened, in the unit of f, for every level before the last; None for not at
    all; of a model that is no scene, one for each point, (N,), or for all. Yields for each level, the coarsest
    first, the indices (M,) of the points where it is defined and f there (M,).
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
    program: Program,
    points: Array,
    level: int,
    time: float = 0.0,
    margins: Margins | None = None,
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
    if program.composition is not None:
        return composed.colour(program, points, time)
    if program.texture is None:
        raise ValueError("the model has no texture")
    return np.clip(np.concatenate(run(program, program.texture, _inputs(program, points, time)), axis=1), 0, 1)


def _inputs(program: Program, points: Array, time: float) -> Array:
    """Return the inputs (N, 4) of the program's functions at points (N, 3)."""
    fourth = np.full((len(points), 1), time if program.moving else 1.0, np.float32)
    return np.concatenate([points.astype(np.float32), fourth], axis=1)
