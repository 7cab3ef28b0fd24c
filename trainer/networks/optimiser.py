"""Adam over the weights of a network, with a rate of its own for the output layer."""

import torch

from .network import Weights

BETAS = (0.9, 0.99)


class Optimiser:
    """Adam on a network's weights, whose .grad the training step fills."""

    def __init__(self, weights: Weights, rate: float, output_factor: float) -> None:
        """Give the weights a .grad of zero.

        rate: the peak rate of the hidden layers; that of the output layer is `output_factor` times as high.
        """
        for weight in weights:
            weight.grad = torch.zeros_like(weight)
        layers = (weights[:-2], rate), (weights[-2:], rate * output_factor)
        groups = [{"params": params, "lr": peak, "peak": peak} for params, peak in layers]
        self._adam = torch.optim.Adam(groups, betas=BETAS, eps=1e-12, fused=True)

    def step(self, factor: float) -> None:
        """Take one step with `factor` times the peak rates, then set the gradients to zero."""
        for group in self._adam.param_groups:
            group["lr"] = factor * group["peak"]
        self._adam.step()
        self._adam.zero_grad(set_to_none=False)
