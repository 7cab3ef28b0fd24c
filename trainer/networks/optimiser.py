"""Adam over the weights of a network, with a rate of its own for the output layer."""

import torch
from torch.optim.adam import adam

from .network import Weights
from .snapshot import Snapshot

BETAS = (0.9, 0.99)
STATE = ("step", "exp_avg", "exp_avg_sq")
"""Names of what Adam knows of a weight: its steps, and the running means of its gradient and of its square."""


class Optimiser:
    """Adam on a network's weights, whose .grad the training step fills.

    It is torch's function, not its class, whose first object imports a compiler for seconds.
    """

    def __init__(self, weights: Weights, rate: float, output_factor: float) -> None:
        """Give the weights a .grad of zero.

        rate: the peak rate of the hidden layers; that of the output layer is `output_factor` times as high.
        """
        self._weights = weights
        for weight in weights:
            weight.grad = torch.zeros_like(weight)
        self._layers = (slice(None, -2), rate), (slice(-2, None), rate * output_factor)
        self._state = {key: [torch.zeros_like(weight) for weight in weights] for key in STATE[1:]}
        self._state[STATE[0]] = [torch.zeros((), dtype=torch.float32, device=weight.device) for weight in weights]

    def snapshot(self) -> Snapshot:
        """Return the state of Adam."""
        return Snapshot(tensors={f"{key}.{i}": state for key in STATE for i, state in enumerate(self._state[key])})

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot. Raises UserError where it is not of weights of these shapes."""
        for key, states in self._state.items():
            self._state[key] = [snapshot.tensor(f"{key}.{i}", state).clone() for i, state in enumerate(states)]

    def step(self, factor: float) -> None:
        """Take one step with `factor` times the peak rates, then set the gradients to zero."""
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
                    eps=1e-12,
                    maximize=False,
                )
            for gradient in gradients:
                gradient.zero_()
