"""A model's field in PyTorch's own operations: differentiable in the points, as often as one likes, on their device."""

from collections.abc import Callable

import torch
from torch.utils.checkpoint import checkpoint

from ...model.errors import UserError
from ...model.model import Model, Network
from .network import Weights

Tensor = torch.Tensor
"""For those who may not import torch."""
CHUNK = 65_536
"""Points that are evaluated at a time; only their layers' values are ever in memory, also on the way back."""


class TorchField:
    """The nested field of a model (Eq. 3) as a function of tensors."""

    def __init__(self, model: Model) -> None:
        self._networks = [_weights(level.network) for level in model.levels]
        self._texture = None if model.texture is None else _weights(model.texture)
        self._deltas = [level.delta for level in model.levels]
        self._moving = model.inputs == "xyzt"

    def value(self, points: Tensor, level: int | None = None, time: float = 0.0) -> Tensor:
        """Evaluate the finest level that is defined at each point, up to `level`; None: up to the last.

        points: (N, 3) float32, model space, on any device. time: the fourth input of a model that moves. Returns (N,)
        float32 there, model units, negative inside. Raises UserError where the model has no such level.
        """
        count = len(self._networks)
        if level is not None and not 1 <= level <= count:
            raise UserError(f"level {level}: the model has levels 1 to {count}")
        networks = [_on(points, weights) for weights in self._networks[:level]]

        def work(points: Tensor) -> Tensor:
            inputs = self._inputs(points, time)
            f = _evaluate(networks[0], inputs)[:, 0]
            defined = torch.arange(len(points), device=points.device)
            last = f
            for weights, delta in zip(networks[1:], self._deltas, strict=False):
                inside = torch.nonzero(last.detach().abs() < delta)[:, 0]
                defined = defined[inside]
                last = last[inside] + _evaluate(weights, inputs[defined])[:, 0]
                f = f.index_put((defined,), last)
            return f

        return _over(points, work)

    def gradient(self, points: Tensor, level: int | None = None, time: float = 0.0) -> Tensor:
        """Evaluate the gradient of what `value` gives, (N, 3); it is differentiable where the points want gradients."""
        wanted = points.requires_grad and torch.is_grad_enabled()
        with torch.enable_grad():
            asked = points if wanted else points.detach().requires_grad_()
            parts = [
                torch.autograd.grad(self.value(part, level, time).sum(), part, create_graph=wanted)[0]
                for part in torch.split(asked, CHUNK)
            ]
        return torch.cat(parts) if parts else torch.zeros_like(points)

    def colour(self, points: Tensor, time: float = 0.0) -> Tensor | None:
        """Evaluate the colour at points (N, 3): (N, 3), sRGB in [0, 1]; None where the model has no texture."""
        if self._texture is None:
            return None
        weights = _on(points, self._texture)
        return _over(points, lambda points: _evaluate(weights, self._inputs(points, time)).clamp(0, 1))

    def _inputs(self, points: Tensor, time: float) -> Tensor:
        return torch.cat([points, points.new_full((len(points), 1), time)], dim=1) if self._moving else points


def _weights(network: Network) -> Weights:
    return [torch.tensor(array) for layer in network for array in (layer.weight, layer.bias)]


def _on(points: Tensor, weights: Weights) -> Weights:
    return [weight.to(points.device) for weight in weights]


def _evaluate(weights: Weights, inputs: Tensor) -> Tensor:
    """Evaluate a network (Eq. 2) at inputs (N, 3 or 4). Returns (N, outputs)."""
    hidden = inputs
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        hidden = torch.addmm(bias, hidden, weight.t()).sin()
    return torch.addmm(weights[-1], hidden, weights[-2].t())


def _over(points: Tensor, work: Callable[[Tensor], Tensor]) -> Tensor:
    """Do some work chunk by chunk; where gradients are wanted, the layers' values are computed anew on the way back."""
    if not (points.requires_grad and torch.is_grad_enabled()):
        with torch.no_grad():
            return torch.cat([work(part) for part in torch.split(points, CHUNK)])
    if len(points) <= CHUNK:
        return work(points)
    parts: list[Tensor] = [checkpoint(work, part, use_reentrant=False) for part in torch.split(points, CHUNK)]
    return torch.cat(parts)
