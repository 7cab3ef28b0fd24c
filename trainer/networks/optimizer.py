"""Adam over the weights of a network, with a separate rate for the output layer."""

import torch
from torch import Tensor
from torch.optim.adam import adam

from .network import Weights
from .snapshot import Snapshot

BETAS = (0.9, 0.99)
EPSILON = 1e-12
STATE = ("step", "exp_avg", "exp_avg_sq")  # Adam's state: steps, running means of the gradient and of its square


class Optimizer:
    """Adam on a network's weights, whose .grad the training step fills.

    It uses torch's function: creating the first object of torch's class imports a compiler for seconds.
    """

    def __init__(self, weights: Weights, rate: float, output_factor: float) -> None:
        """Set the weights' .grad to zero.

        rate: peak rate of the hidden layers. output_factor: the output layer's rate relative to it.
        """
        self._weights = weights
        for weight in weights:
            weight.grad = torch.zeros_like(weight)
        self._layers = (slice(None, -2), rate), (slice(-2, None), rate * output_factor)
        self._state = {key: [torch.zeros_like(weight) for weight in weights] for key in STATE[1:]}
        self._state[STATE[0]] = [torch.zeros((), dtype=torch.float32, device=weight.device) for weight in weights]

    def snapshot(self) -> Snapshot:
        """Return the state."""
        return Snapshot(tensors={f"{key}.{i}": state for key in STATE for i, state in enumerate(self._state[key])})

    def restore(self, snapshot: Snapshot) -> None:
        """Continue from a snapshot. Raises UserError if it belongs to weights of other shapes."""
        for key, states in self._state.items():
            for i, state in enumerate(states):
                state.copy_(snapshot.tensor(f"{key}.{i}", state))

    def step(self, factor: float | Tensor) -> None:
        """Take one step with `factor` times the peak rates, then set the gradients to zero.

        factor: a number, or a tensor () on the weights' CUDA device.
        """
        gradients = [weight.grad for weight in self._weights if weight.grad is not None]
        steps, means, squares = (self._state[key] for key in STATE)
        with torch.no_grad():
            for part, peak in self._layers:
                adam(
                    self._weights[part],
                    gradients[part],
                    means[part],
                    squares[part],
                    [],
                    steps[part],
                    fused=True,
                    amsgrad=False,
                    beta1=BETAS[0],
                    beta2=BETAS[1],
                    lr=factor * peak,
                    weight_decay=0.0,
                    eps=EPSILON,
                    maximize=False,
                )
            for gradient in gradients:
                gradient.zero_()
