"""The multiscale field of several networks: the plain sum f_i = f_1 + r_1 + ... + r_{i-1}, and its nesting (Eq. 3).

Everything is evaluated without an autograd graph and in chunks, so that a large number of points needs little memory.
"""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from .network import Weights, value, value_and_gradient

CHUNK = 8192
"""Points that a network is evaluated at in one call."""

Columns = tuple[Tensor, ...]
"""Tensors with a row for each point; the first one holds the values of the field."""
Rows = Tensor | slice
"""Which of the points: a mask (N,), or a slice."""


@torch.no_grad()
def field(levels: Sequence[Weights], points: Tensor) -> Tensor:
    """Sum the values of all `levels` at points (N, 3), whether a level is defined there or not. Returns f_i (N,)."""
    f = points.new_zeros(len(points))
    for k in range(0, len(points), CHUNK):
        for weights in levels:
            f[k : k + CHUNK] += value(weights, points[k : k + CHUNK])[:, 0]
    return f


@torch.no_grad()
def field_and_gradient(levels: Sequence[Weights], points: Tensor) -> tuple[Tensor, Tensor]:
    """Sum the values and the gradients of all `levels` at points (N, 3). Returns f_i (N,) and grad f_i (N, 3)."""
    f, gradient = points.new_zeros(len(points)), torch.zeros_like(points)
    for k in range(0, len(points), CHUNK):
        for weights in levels:
            value_part, gradient_part = value_and_gradient(weights, points[k : k + CHUNK])
            f[k : k + CHUNK] += value_part
            gradient[k : k + CHUNK] += gradient_part
    return f, gradient


def nested_field(levels: Sequence[Weights], deltas: Sequence[float], points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate the finest level that is defined at each of the points (N, 3), by Eq. 3.

    deltas: the half widths of the bands of all levels but the last, whose own may follow and is not used. Returns the
    value of that level (N,), and its number (N,) int64, counted from 1.
    """

    def evaluate(weights: Weights, inside: Rows) -> Columns:
        # At all points, not at those inside alone: the last digits of a matrix product depend on how many rows it has,
        # and the samples of a seed depend on these digits.
        return (field([weights], points)[inside],)

    (f,), reached = _nested(levels, deltas, len(points), evaluate)
    return f, reached


def nested_field_and_gradient(
    levels: Sequence[Weights], deltas: Sequence[float], points: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Evaluate the finest level that is defined at each of the points (N, 3), and its gradient, by Eq. 3.

    Takes what `nested_field` takes. Returns the value (N,), the gradient (N, 3), and the level's number (N,) int64.
    """

    def evaluate(weights: Weights, inside: Rows) -> Columns:
        return field_and_gradient([weights], points[inside])

    (f, gradient), reached = _nested(levels, deltas, len(points), evaluate)
    return f, gradient, reached


def in_band(levels: Sequence[Weights], deltas: Sequence[float], points: Tensor) -> Tensor:
    """Tell where one more level after `levels` would be defined: |f_k| < delta_k for every one of them (Eq. 3).

    deltas: as many as levels. points: (N, 3). Returns (N,) bool; all true where there are no levels yet.
    """
    if not levels:
        return torch.ones(len(points), dtype=torch.bool, device=points.device)
    f, reached = nested_field(levels, deltas, points)
    return (reached == len(levels)) & (f.abs() < deltas[len(levels) - 1])


@torch.no_grad()
def _nested(
    levels: Sequence[Weights],
    deltas: Sequence[float],
    count: int,
    evaluate: Callable[[Weights, Rows], Columns],
) -> tuple[Columns, Tensor]:
    """The rule of Eq. 3: f_{i+1} = f_i + r_i where |f_i| < delta_i, and f_i is the answer elsewhere.

    count: the number of points. evaluate: the columns of one network at some of the points. Returns the columns,
    summed up to the finest level defined at each point, and that level's number (count,) int64.
    """
    columns = evaluate(levels[0], slice(None))
    reached = torch.ones(count, dtype=torch.int64, device=columns[0].device)
    for i in range(1, len(levels)):
        inside = (reached == i) & (columns[0].abs() < deltas[i - 1])
        for column, part in zip(columns, evaluate(levels[i], inside), strict=True):
            column[inside] += part
        reached[inside] = i + 1
    return columns, reached
