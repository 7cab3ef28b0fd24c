"""A field that NumPy evaluates, as a function of tensors that is differentiable once in the points."""

from typing import Any, Protocol, cast

import numpy as np
import torch
from numpy.typing import NDArray

from ...model.errors import UserError

Array = NDArray[np.float32]
Tensor = torch.Tensor


class Evaluated(Protocol):
    """A field of arrays; points are (N, 3), model space. See `TorchField`."""

    def value(self, points: Array, level: int | None, time: float) -> Array:
        """Evaluate the field, (N,)."""

    def gradient(self, points: Array, level: int | None, time: float) -> Array:
        """Evaluate the gradient, (N, 3)."""

    def color(self, points: Array, time: float) -> Array | None:
        """Evaluate the color, (N, 3)."""


class ArrayField:
    """The methods of `TorchField` for scenes, whose composition only NumPy evaluates.

    Values are differentiable in the points; gradients and colors are not.
    """

    def __init__(self, field: Evaluated) -> None:
        self._field = field

    def value(self, points: Tensor, level: int | None = None, time: float = 0.0) -> Tensor:
        """Evaluate the finest defined level, up to `level`, at points (N, 3). Returns (N,)."""
        return cast(Tensor, _Value.apply(points, self._field, level, time))  # type: ignore[no-untyped-call]

    def gradient(self, points: Tensor, level: int | None = None, time: float = 0.0) -> Tensor:
        """Evaluate the gradient of `value`, (N, 3)."""
        return _tensor(self._field.gradient(_array(points), level, time), points)

    def color(self, points: Tensor, time: float = 0.0) -> Tensor | None:
        """Evaluate the color (N, 3), sRGB in [0, 1]; None for a scene without colors."""
        colors = self._field.color(_array(points), time)
        return None if colors is None else _tensor(colors, points)


class _Value(torch.autograd.Function):
    """The field's value, with its gradient as derivative."""

    @staticmethod
    def forward(ctx: Any, points: Tensor, field: Evaluated, level: int | None, time: float) -> Tensor:
        ctx.save_for_backward(points)
        ctx.arguments = field, level, time
        return _tensor(field.value(_array(points), level, time), points)

    @staticmethod
    def backward(ctx: Any, above: Tensor) -> tuple[Tensor, None, None, None]:
        if torch.is_grad_enabled():  # create_graph=True
            raise UserError("a scene is differentiable once: its gradient has no derivative")
        (points,) = ctx.saved_tensors
        field, level, time = ctx.arguments
        return above[:, None] * _tensor(field.gradient(_array(points), level, time), points), None, None, None


def _array(points: Tensor) -> Array:
    return points.detach().cpu().numpy()


def _tensor(array: Array, points: Tensor) -> Tensor:
    """Convert an array to a tensor on the points' device."""
    return torch.from_numpy(np.ascontiguousarray(array)).to(points)
