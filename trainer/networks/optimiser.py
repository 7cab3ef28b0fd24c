"""Adam over a network's weights, with a rate of its own for the output layer."""

import torch

from .network import Weights

BETAS = (0.9, 0.99)


class Optimiser:
    """rate: the peak rate of the hidden layers. last: factor on it for the output layer."""

    def __init__(self, weights: Weights, rate: float, last: float) -> None:
        for weight in weights:
            weight.grad = torch.zeros_like(weight)
        layers = (weights[:-2], rate), (weights[-2:], rate * last)
        groups = [{"params": params, "lr": peak, "peak": peak} for params, peak in layers]
        self._adam = torch.optim.Adam(groups, betas=BETAS, eps=1e-12, fused=True)

    def step(self, factor: float) -> None:
        """One step with `factor` times the peak rate; clears the gradients."""
        for group in self._adam.param_groups:
            group["lr"] = factor * group["peak"]
        self._adam.step()
        self._adam.zero_grad(set_to_none=False)
