"""Converts points and directions between model space and file space, and checks their shapes."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Union, cast

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show, show_value
from ..model.model import MODEL_SPACE, SPACES, Model
from ..model.orientation import as_in_file, upright
from ..model.value_types import fits

if TYPE_CHECKING:
    from ..trainer.networks.torch_field import Tensor

Array = NDArray[np.float32]
Nested = Sequence[Union[float, "Nested"]]
Points = NDArray[np.floating] | NDArray[np.integer] | Nested
"""Points (..., 3): arrays, or nested lists."""


class Space:
    """The space of a caller's points: `scale` is the length of model space's unit in it."""

    def __init__(self, model: Model, name: str) -> None:
        """name: one of `SPACES`. Raises UserError for any other."""
        if not isinstance(name, str) or name not in SPACES:
            raise UserError(f"space {show_value(name)} is none of {', '.join(SPACES)}")
        self._model, self._is_file = model, name == "input"
        self.scale = model.scale if self._is_file else 1.0

    def rows(self, points: object) -> tuple[NDArray[np.floating], tuple[int, ...]]:
        """Convert points (..., 3) to model space. Returns (N, 3) and the shape (...). Raises UserError."""
        array = numbers(points)
        rows = array.reshape(-1, 3)
        return self.to_model(rows) if self._is_file else rows, array.shape[:-1]

    def to_model(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Convert points (N, 3) to model space."""
        doubles = points.astype(np.float64)
        return (upright(doubles, self._model.up) - self._model.center) / self._model.scale if self._is_file else doubles

    def directions_to_model(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rotate directions (N, 3) to model space."""
        return upright(directions, self._model.up) if self._is_file else directions

    def directions_from_model(self, directions: NDArray[np.floating]) -> Array:
        """Rotate directions (N, 3) from model space."""
        if not self._is_file:
            return directions.astype(np.float32, copy=False)
        return as_in_file(directions.astype(np.float64), self._model.up).astype(np.float32)

    def tensor_to_model(self, points: "Tensor") -> "Tensor":
        """Convert a tensor of points (..., 3) to model space: (N, 3) float32. Raises UserError."""
        rows = points.reshape(-1, 3)
        if self._is_file:
            rows = rows.double() @ rows.new_tensor(upright(np.eye(3), self._model.up)).double()
            rows = (rows - rows.new_tensor(self._model.center)) / self._model.scale
        return rows.float()

    def tensor_from_model(self, directions: "Tensor") -> "Tensor":
        """Rotate a tensor of directions (N, 3) from model space."""
        if not self._is_file or self._model.up == MODEL_SPACE[2]:
            return directions
        return directions @ directions.new_tensor(upright(np.eye(3), self._model.up).T)


def as_tensor(points: "Points | Tensor", name: str = "points") -> "Tensor | None":
    """Return a PyTorch tensor (..., 3) of real numbers, and None for any other points. Does not load PyTorch.

    name: of the argument, for the UserError about a tensor that cannot be evaluated.
    """
    if not type(points).__module__.startswith("torch"):
        return None
    from ..trainer.networks.torch_field import Tensor, plain_tensor

    if not isinstance(points, Tensor):
        return None
    tensor = plain_tensor(points, name)
    _check_last_axis(tuple(tensor.shape), name)
    return tensor


def numbers(points: object, name: str = "points") -> NDArray[np.floating]:
    """Return points (..., 3) as an array: float32 stays, all else becomes float64. Raises UserError.

    name: of the argument, for messages.
    """
    try:
        array = np.asarray(points)
        if array.dtype.kind not in "fiubO" or np.ma.is_masked(points):
            raise TypeError
        floats = array if array.dtype == np.float32 else np.asarray(array, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise UserError(f"{name}: real numbers of shape (..., 3) are needed") from None
    _check_last_axis(floats.shape, name)
    return floats


def arrays(points: "Points | Tensor", name: str) -> NDArray[np.floating]:
    """Return points (..., 3), also those of a tensor, as an array. Raises UserError where it requires gradients."""
    tensor = as_tensor(points, name)
    if tensor is None:
        return numbers(points, name)
    if tensor.requires_grad:
        raise UserError(f"{name}: the tensor requires gradients, and rays have none; pass {name}.detach()")
    return numbers(tensor.cpu().double().numpy(), name)


def checked_time(time: object, model: Model) -> float:
    """Return the time at which a model is evaluated. Raises UserError."""
    value = time.tolist() if hasattr(time, "tolist") else time
    if not fits(value, float) or not 0 <= cast(float, value) <= 1:
        raise UserError(f"time {show_value(time)}: a number from 0 to 1 is needed")
    if value and model.inputs != "xyzt":
        raise UserError(f"time {show(str(value))[:60]}: this model does not move")
    return float(cast(float, value))


def _check_last_axis(shape: tuple[int, ...], name: str) -> None:
    if not shape or shape[-1] != 3:
        raise UserError(f"{name} of shape {shape}: the last axis must be x, y, z")
