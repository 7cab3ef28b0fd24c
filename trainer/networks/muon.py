"""Muon (Jordan et al. 2024): steps of square matrices whose singular values are all near one."""

import torch
from torch import Tensor

from .network import Weights
from .optimizer import Optimizer
from .replay import Replay, records
from .snapshot import Snapshot

MOMENTUM = 0.95
ITERATIONS = 3
COEFFICIENTS = (3.4445, -4.775, 2.0315)  # of a polynomial that is steep at zero, and near one between 0.3 and 1
ROOT_MEAN_SQUARE = 0.3  # of a step's entries, relative to the rate: as of Adam's steps (Liu et al. 2025)
NARROWEST = 64  # Steps of narrower matrices are as long as those of this width.


class Muon:
    """Muon on the hidden layers' matrices of a network, whose .grad the training step fills; Adam on its other weights.

    Unlike torch.optim.Muon, it takes all matrices at once, in 32 bits.
    """

    def __init__(self, weights: Weights, rate: float, output_factor: float) -> None:
        """Set the weights' .grad to zero. rate, output_factor: as for `Optimizer`."""
        self._weights, self._matrices, self._replay = weights, weights[2:-2:2], Replay()
        others = [weight for i, weight in enumerate(weights) if i % 2 or i in (0, len(weights) - 2)]
        self._adam, self._rate = Optimizer(others, rate, output_factor), rate
        for matrix in self._matrices:
            matrix.grad = torch.zeros_like(matrix)
        width = weights[0].shape[0]
        self._momentum = torch.zeros((len(self._matrices), width, width), device=weights[0].device)

    def snapshot(self) -> Snapshot:
        """Return the state."""
        return self._adam.snapshot() | Snapshot(tensors={"momentum": self._momentum})

    def restore(self, snapshot: Snapshot) -> None:
        """Continue from a snapshot. Raises UserError if it belongs to weights of other shapes."""
        self._adam.restore(snapshot)
        self._momentum.copy_(snapshot.tensor("momentum", self._momentum))

    def step(self, factor: float) -> None:
        """Take one step with `factor` times the peak rates, then set the gradients to zero."""
        device = self._momentum.device
        self._replay(self._step, self._weights, torch.full((), factor, device=device) if records(device) else factor)

    def _step(self, _: Weights, factor: float | Tensor) -> None:
        self._adam.step(factor)
        if not self._matrices:
            return
        gradients = [matrix.grad for matrix in self._matrices if matrix.grad is not None]
        with torch.no_grad():
            gradient = torch.stack(gradients)
            self._momentum.lerp_(gradient, 1 - MOMENTUM)
            step = orthogonal(torch.lerp(gradient, self._momentum, MOMENTUM))  # Nesterov's momentum
            size = factor * self._rate * ROOT_MEAN_SQUARE * max(step.shape[1], NARROWEST) ** 0.5
            torch._foreach_sub_(self._matrices, list(step * size))
            torch._foreach_zero_(gradients)


def orthogonal(matrices: Tensor) -> Tensor:
    """Bring the singular values of matrices (K, N, N) near one, by a Newton-Schulz iteration."""
    a, b, c = COEFFICIENTS
    x = torch.nn.functional.normalize(matrices.flatten(1), eps=1e-20).view_as(matrices)
    for _ in range(ITERATIONS):
        square = torch.bmm(x, x.mT)
        x = torch.baddbmm(x, torch.baddbmm(square, square, square, beta=b, alpha=c), x, beta=a)
    return x
