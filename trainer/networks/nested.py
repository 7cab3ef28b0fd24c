"""The field of several networks: the plain sum f_i = f_1 + r_1 + ... + r_{i-1}, and the nested field (Eq. 3).

The functions evaluate blocks of points without an autograd graph, so that many points need little memory.
"""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from .network import Weights, value, value_and_gradient

CHUNK = 8192  # points per block

Columns = tuple[Tensor, ...]
"""Tensors with one row per point; the first one is the value of the field."""


@torch.no_grad()
def field(levels: Sequence[Weights], points: Tensor) -> Tensor:
    """Sum all `levels` at points (N, 3), also where a level is not defined. Returns f_i (N,)."""
    f = points.new_zeros(len(points))
    for k in range(0, len(points), CHUNK):
        for weights in levels:
            f[k : k + CHUNK] += value(weights, points[k : k + CHUNK])[:, 0]
    return f


@torch.no_grad()
def field_and_gradient(levels: Sequence[Weights], points: Tensor) -> tuple[Tensor, Tensor]:
    """Sum the values and gradients of all `levels` at points (N, 3). Returns f_i (N,) and grad f_i (N, 3)."""
    f, gradient = points.new_zeros(len(points)), torch.zeros_like(points)
    for k in range(0, len(points), CHUNK):
        for weights in levels:
            value_part, gradient_part = value_and_gradient(weights, points[k : k + CHUNK])
            f[k : k + CHUNK] += value_part
            gradient[k : k + CHUNK] += gradient_part
    return f, gradient


def nested_field(levels: Sequence[Weights], deltas: Sequence[float], points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate the finest defined level at each of the points (N, 3).

    deltas: band half-widths of all levels but the last, whose own may follow and is ignored. Returns the level's value
    (N,), and its number (N,) int64, counted from 1.
    """

    def evaluate(weights: Weights, inside: Tensor | slice) -> Columns:
        # All points, not only those inside: the last digits of a matrix product depend on its number of rows, and the
        # samples of a seed depend on these digits.
        return (field([weights], points)[inside],)

    (f,), reached = _nested(levels, deltas, len(points), evaluate)
    return f, reached


def nested_field_and_gradient(
    levels: Sequence[Weights], deltas: Sequence[float], points: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Evaluate `nested_field` with gradients. Returns the value (N,), the gradient (N, 3), and the level's number."""

    def evaluate(weights: Weights, inside: Tensor | slice) -> Columns:
        return field_and_gradient([weights], points[inside])

    (f, gradient), reached = _nested(levels, deltas, len(points), evaluate)
    return f, gradient, reached


def in_band(levels: Sequence[Weights], deltas: Sequence[float], points: Tensor) -> Tensor:
    """Return where a level after `levels` is defined: |f_k| < delta_k for all of them (Eq. 3).

    deltas: of all levels. points: (N, 3). Returns (N,) bool, all true without levels.
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
    evaluate: Callable[[Weights, Tensor | slice], Columns],
) -> tuple[Columns, Tensor]:
    """Apply Eq. 3: f_{i+1} = f_i + r_i where |f_i| < delta_i, and f_i elsewhere.

    count: the number of points. evaluate: the columns of one network at a mask (N,) or slice of the points. Returns the
    columns, summed up to the finest defined level of each point, and that level's number (count,) int64.
    """
    columns = evaluate(levels[0], slice(None))
    reached = torch.ones(count, dtype=torch.int64, device=columns[0].device)
    for i in range(1, len(levels)):
        inside = (reached == i) & (columns[0].abs() < deltas[i - 1])
        for column, part in zip(columns, evaluate(levels[i], inside), strict=True):
            column[inside] += part
        reached[inside] = i + 1
    return columns, reached
