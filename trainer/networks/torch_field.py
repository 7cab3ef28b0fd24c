"""A model's field in PyTorch operations: arbitrarily often differentiable in the points, on their device."""

from collections.abc import Callable

import torch
from torch.utils.checkpoint import checkpoint

from ...model.errors import UserError
from ...model.model import Model
from .network import Weights, from_model
from .network import value as evaluate

Tensor = torch.Tensor  # for modules that may not import torch
CHUNK = 65_536  # points per block; only one block's layers are in memory, also in the backward pass


def plain_tensor(points: Tensor, name: str) -> Tensor:
    """Return a tensor that networks can be evaluated at: a copy of one that inference mode made.

    name: of the argument. Raises UserError for numbers that are not real, and for a tensor without values of its own.
    """
    kinds = {
        "sparse": points.layout != torch.strided,
        "quantized": points.is_quantized,
        "nested": points.is_nested,
        "meta": points.is_meta,
        "complex": points.is_complex(),
        "vmap's": _is_batched(points),
    }
    if kind := next((kind for kind, holds in kinds.items() if holds), None):
        raise UserError(f"{name}: a dense tensor of real numbers is needed, and this is {kind}")
    return points.clone() if points.is_inference() else points


def _is_batched(points: Tensor) -> bool:
    """Whether torch.func.vmap made a tensor, or a tensor inside it: no level is defined at the same points of all."""
    functorch = torch._C._functorch
    while functorch.is_functorch_wrapped_tensor(points):
        if functorch.is_batchedtensor(points):
            return True
        points = functorch.get_unwrapped(points)
    return False


class TorchField:
    """The nested field of a model (Eq. 3) as a function of tensors."""

    def __init__(self, model: Model) -> None:
        with torch.inference_mode(False):  # The first caller may be inside; later ones want derivatives.
            self._networks = [from_model(level.network) for level in model.levels]
            self._texture = None if model.texture is None else from_model(model.texture)
        self._deltas = [level.delta for level in model.levels]
        self._moving = model.inputs == "xyzt"

    def value(self, points: Tensor, level: int | None = None, time: float = 0.0) -> Tensor:
        """Evaluate the finest defined level at each point, up to `level`; None: up to the last.

        points: (N, 3) float32, model space, on any device. time: fourth input of a moving model. Returns (N,) float32
        on the same device, model units, negative inside. Raises UserError if the model has no such level.
        """
        count = len(self._networks)
        if level is not None and not 1 <= level <= count:
            raise UserError(f"level {level}: the model has levels 1 to {count}")
        networks = [_on(points, weights) for weights in self._networks[:level]]

        def work(points: Tensor) -> Tensor:
            inputs = self._inputs(points, time)
            f = evaluate(networks[0], inputs)[:, 0]
            defined = torch.arange(len(points), device=points.device)
            last = f
            for weights, delta in zip(networks[1:], self._deltas, strict=False):
                inside = torch.nonzero(last.detach().abs() < delta)[:, 0]
                defined = defined[inside]
                last = last[inside] + evaluate(weights, inputs[defined])[:, 0]
                f = f.index_put((defined,), last)
            return f

        return _over(points, work)

    def gradient(self, points: Tensor, level: int | None = None, time: float = 0.0) -> Tensor:
        """Evaluate the gradient of `value`, (N, 3); differentiable if the points require gradients."""
        differentiable = points.requires_grad and torch.is_grad_enabled()
        with torch.inference_mode(False), torch.enable_grad():
            points = points.clone() if points.is_inference() else points
            leaves = points if differentiable else points.detach().requires_grad_()
            parts = [
                torch.autograd.grad(self.value(part, level, time).sum(), part, create_graph=differentiable)[0]
                for part in torch.split(leaves, CHUNK)
            ]
        return torch.cat(parts) if parts else torch.zeros_like(points)

    def color(self, points: Tensor, time: float = 0.0) -> Tensor | None:
        """Evaluate the color (N, 3), sRGB in [0, 1], at points (N, 3); None for a model without a texture."""
        if self._texture is None:
            return None
        weights = _on(points, self._texture)
        return _over(points, lambda points: evaluate(weights, self._inputs(points, time)).clamp(0, 1))

    def _inputs(self, points: Tensor, time: float) -> Tensor:
        return torch.cat([points, points.new_full((len(points), 1), time)], dim=1) if self._moving else points


def _on(points: Tensor, weights: Weights) -> Weights:
    return [weight.to(points.device) for weight in weights]


def _over(points: Tensor, work: Callable[[Tensor], Tensor]) -> Tensor:
    """Apply a function to blocks of points; the backward pass recomputes each block's layers."""
    if not (points.requires_grad and torch.is_grad_enabled()):
        with torch.no_grad():
            return torch.cat([work(part) for part in torch.split(points, CHUNK)])
    if len(points) <= CHUNK:
        return work(points)
    parts: list[Tensor] = [checkpoint(work, part, use_reentrant=False) for part in torch.split(points, CHUNK)]
    return torch.cat(parts)
