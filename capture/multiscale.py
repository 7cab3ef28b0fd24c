"""The multiscale field during reconstruction: values, gradients, and the derivatives by its weights.

The loss depends on f, on grad f and, through the colors, on the last hidden layers, which are the radiance network's
features. The trainer's adjoint pass computes all three without a graph; they are the leaves of the loss's graph. The
hand-written derivative of the adjoint pass then propagates their .grad to the weights. Nothing is differentiated twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from ..trainer.networks.nested import CHUNK, nested_field
from ..trainer.networks.network import Adjoint, Weights, add_derivative, adjoint_pass


@dataclass(frozen=True, eq=False)
class Evaluated:
    """The field at N points. The tensors are leaves that require gradients."""

    f: Tensor
    """(N,)."""
    gradient: Tensor
    """(N, 3)."""
    features: Tensor
    """(N, F): the last hidden layers of all levels side by side, 0 where a level is not evaluated."""
    passes: list[tuple[Adjoint, Tensor]]
    """For each level: its adjoint pass, and the indices (M,) of the points where the level is defined."""


class MultiscaleField:
    """Nested levels (Eq. 3) whose weights are trained together."""

    def __init__(self, levels: Sequence[Weights], deltas: Sequence[float]) -> None:
        """levels: networks, coarse to fine. deltas: band half-widths of all levels but the last."""
        self.levels, self.deltas = list(levels), list(deltas)
        self.widths = [len(weights[-3]) for weights in levels]
        """Widths of the last hidden layers."""
        self.active = len(levels)
        """Number of levels in use; finer levels are neither evaluated nor trained."""

    def values(self, points: Tensor, active: int | None = None) -> Tensor:
        """Evaluate `active` levels (None: all in use) at points (N, 3). Returns (N,)."""
        count = active or self.active
        return nested_field(self.levels[:count], self.deltas[: count - 1], points)[0]

    def evaluate(self, points: Tensor) -> Evaluated:
        """Evaluate the field and its gradient at points (N, 3), each residual only in its band."""
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
        for (forward, index), part in zip(passes, torch.split(features, self.widths, dim=1), strict=False):
            part[index] = forward.hidden[-1]
        return Evaluated(f.requires_grad_(), gradient.requires_grad_(), features.requires_grad_(), passes)

    def features(self, points: Tensor) -> Tensor:
        """Evaluate the features (N, F) at points (N, 3), without a graph."""
        parts = [self.evaluate(part).features.detach() for part in torch.split(points, CHUNK)]
        return torch.cat(parts)

    def backward(self, evaluated: Evaluated) -> None:
        """Propagate the leaves' .grad to the weights' .grad."""
        d_f, d_gradient, d_features = (
            torch.zeros_like(leaf) if leaf.grad is None else leaf.grad
            for leaf in (evaluated.f, evaluated.gradient, evaluated.features)
        )
        parts = torch.split(d_features, self.widths, dim=1)
        for weights, (forward, inside), d_last in zip(self.levels, evaluated.passes, parts, strict=False):
            add_derivative(weights, forward, d_f[inside], d_gradient[inside], d_last[inside])
