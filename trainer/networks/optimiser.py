"""Adam over the weights of a network, with a rate of its own for the output layer."""

import torch

from .network import Weights
from .snapshot import Snapshot

BETAS = (0.9, 0.99)
STATE = ("step", "exp_avg", "exp_avg_sq")
"""Names of what torch.optim.Adam knows of a weight after its first step."""


class Optimiser:
    """Adam on a network's weights, whose .grad the training step fills."""

    def __init__(self, weights: Weights, rate: float, output_factor: float) -> None:
        """Give the weights a .grad of zero.

        rate: the peak rate of the hidden layers; that of the output layer is `output_factor` times as high.
        """
        self._weights = weights
        for weight in weights:
            weight.grad = torch.zeros_like(weight)
        layers = (weights[:-2], rate), (weights[-2:], rate * output_factor)
        groups = [{"params": params, "lr": peak, "peak": peak} for params, peak in layers]
        self._adam = torch.optim.Adam(groups, betas=BETAS, eps=1e-12, fused=True)

    def snapshot(self) -> Snapshot:
        """Return the state of Adam after one step or more."""
        state = self._adam.state
        tensors = {f"{key}.{i}": state[w][key] for i, w in enumerate(self._weights) for key in STATE}
        return Snapshot(tensors=tensors)

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot. Raises UserError where it is not of weights of these shapes."""
        for i, weight in enumerate(self._weights):
            like = {"step": weight.new_zeros(())} | dict.fromkeys(STATE[1:], weight)
            self._adam.state[weight] = {key: snapshot.tensor(f"{key}.{i}", like[key]).clone() for key in STATE}

    def step(self, factor: float) -> None:
        """Take one step with `factor` times the peak rates, then set the gradients to zero."""
        for group in self._adam.param_groups:
            group["lr"] = factor * group["peak"]
        self._adam.step()
        self._adam.zero_grad(set_to_none=False)
