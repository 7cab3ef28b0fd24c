"""The multiscale field while it is learnt from photographs: its value and gradient, and the way back to its weights.

A loss on volume rendering depends on f, on grad f, and, by the colours, on the last hidden layers, which tell the
radiance network where it is. All come without a graph from the trainer's adjoint pass and are the leaves of a graph
that ends in the loss. What that leaves in their .grad goes on to the weights by the derivative of the adjoint pass,
which is written out by hand. Nothing is differentiated twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from ..trainer.networks.nested import CHUNK, nested_field
from ..trainer.networks.network import Adjoint, Weights, add_derivative, adjoint_pass


@dataclass(frozen=True, eq=False)
class Evaluated:
    """The field at N points."""

    f: Tensor
    """(N,), a leaf that wants a gradient."""
    gradient: Tensor
    """(N, 3), a leaf likewise."""
    features: Tensor
    """(N, F), a leaf likewise: the last hidden layers of all levels side by side, 0 where a level is not evaluated."""
    passes: list[tuple[Adjoint, Tensor]]
    """Of each level: what `add_derivative` needs, and the indices (M,) of the points where the level is defined."""


class MultiscaleField:
    """Nested levels (Eq. 3) whose weights are learnt all at once."""

    def __init__(self, levels: Sequence[Weights], deltas: Sequence[float]) -> None:
        """levels: networks, coarse to fine. deltas: half widths of the bands of all levels but the last."""
        self.levels, self.deltas = list(levels), list(deltas)
        self.widths = [len(weights[-3]) for weights in levels]
        """Of the last hidden layers."""
        self.active = len(levels)
        """Levels that are used; finer ones are not evaluated and learn nothing."""

    def values(self, points: Tensor, active: int | None = None) -> Tensor:
        """Evaluate the field at points (N, 3), with `active` levels; None: with those in use. Returns (N,)."""
        count = active or self.active
        return nested_field(self.levels[:count], self.deltas[: count - 1], points)[0]

    def evaluate(self, points: Tensor) -> Evaluated:
        """Evaluate the field and its gradient at points (N, 3). A residual is evaluated in its band alone."""
        first = adjoint_pass(self.levels[0], points)
        f, gradient = first.f.clone(), first.gradient.clone()
        inside = torch.arange(len(points), device=points.device)
        passes = [(first, inside)]
        for weights, delta in zip(self.levels[1 : self.active], self.deltas, strict=False):
            inside = inside[f[inside].abs() < delta]
            residual = adjoint_pass(weights, points[inside])
            f[inside] += residual.f
            gradient[inside] += residual.gradient
            passes.append((residual, inside))
        features = points.new_zeros(len(points), sum(self.widths))
        for (forward, where), part in zip(passes, torch.split(features, self.widths, dim=1), strict=False):
            part[where] = forward.hidden[-1]
        return Evaluated(f.requires_grad_(), gradient.requires_grad_(), features.requires_grad_(), passes)

    def features(self, points: Tensor) -> Tensor:
        """Evaluate the features (N, F) at points (N, 3), without a graph."""
        parts = [self.evaluate(part).features.detach() for part in torch.split(points, CHUNK)]
        return torch.cat(parts)

    def backward(self, evaluated: Evaluated) -> None:
        """Add the derivative of a loss, which is in the leaves' .grad, to that of the weights."""
        d_f, d_gradient, d_features = (
            torch.zeros_like(leaf) if leaf.grad is None else leaf.grad
            for leaf in (evaluated.f, evaluated.gradient, evaluated.features)
        )
        parts = torch.split(d_features, self.widths, dim=1)
        for weights, (forward, inside), d_last in zip(self.levels, evaluated.passes, parts, strict=False):
            add_derivative(weights, forward, d_f[inside], d_gradient[inside], d_last[inside])
