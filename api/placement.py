"""Where points are meant to be: brought from what a program has into model space, and what comes of them back."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Union

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.model import MODEL_SPACE, Model
from ..model.orientation import as_in_file, upright

if TYPE_CHECKING:
    from ..trainer.networks.differentiable import Tensor

Array = NDArray[np.float32]
Nested = Sequence[Union[float, "Nested"]]
Points = NDArray[np.floating] | NDArray[np.integer] | Nested
"""Points (..., 3): arrays of any shape that ends in 3, or lists of them."""

SPACES = ("model", "input")
"""Of points, rays and what comes out: where the shape fits the unit sphere, or where the shape's file has it."""


class Placement:
    """One space in which a model is asked."""

    def __init__(self, model: Model, space: str) -> None:
        """space: one of `SPACES`. Raises UserError for any other."""
        if space not in SPACES:
            raise UserError(f"space {space!r} is none of {', '.join(SPACES)}")
        self._model, self._of_file = model, space == "input"
        self.scale = model.scale if self._of_file else 1.0
        """The length of model space's unit in this space."""

    def rows(self, points: object) -> tuple[NDArray[np.floating], tuple[int, ...]]:
        """Bring points (..., 3) into model space: (N, 3), and the shape (...). Raises UserError."""
        given = numbers(points)
        return self.into_model(given.reshape(-1, 3)) if self._of_file else given.reshape(-1, 3), given.shape[:-1]

    def into_model(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Bring points (N, 3) into model space."""
        placed = points.astype(np.float64)
        return (upright(placed, self._model.up) - self._model.centre) / self._model.scale if self._of_file else placed

    def turned(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn directions (N, 3) into model space."""
        return upright(directions, self._model.up) if self._of_file else directions

    def turned_back(self, directions: NDArray[np.floating]) -> Array:
        """Turn directions (N, 3) from model space."""
        if not self._of_file:
            return directions.astype(np.float32, copy=False)
        return as_in_file(directions.astype(np.float64), self._model.up).astype(np.float32)

    def tensor(self, points: "Tensor") -> "Tensor":
        """Bring a tensor of points (..., 3) into model space: (N, 3) float32. Raises UserError."""
        _check_last_axis(tuple(points.shape))
        rows = points.reshape(-1, 3)
        if self._of_file:
            rows = rows.double() @ rows.new_tensor(upright(np.eye(3), self._model.up)).double()
            rows = (rows - rows.new_tensor(self._model.centre)) / self._model.scale
        return rows.float()

    def tensor_turned_back(self, directions: "Tensor") -> "Tensor":
        """Turn a tensor of directions (N, 3) from model space."""
        if not self._of_file or self._model.up == MODEL_SPACE[2]:
            return directions
        return directions @ directions.new_tensor(upright(np.eye(3), self._model.up).T)


def as_tensor(points: "Points | Tensor") -> "Tensor | None":
    """Return points that are a tensor of PyTorch; None for all others. PyTorch is not loaded to find out."""
    if not type(points).__module__.startswith("torch"):
        return None
    from ..trainer.networks.differentiable import Tensor

    return points if isinstance(points, Tensor) else None


def numbers(points: object) -> NDArray[np.floating]:
    """Return points (..., 3) as floats: those that are float32 as they are, others as doubles.

    Raises UserError where they are none.
    """
    try:
        given = np.asarray(points)
        floats = given if given.dtype == np.float32 else np.asarray(given, np.float64)
    except (TypeError, ValueError):
        raise UserError("points: numbers of shape (..., 3) are needed") from None
    _check_last_axis(floats.shape)
    return floats


def _check_last_axis(shape: tuple[int, ...]) -> None:
    if not shape or shape[-1] != 3:
        raise UserError(f"points of shape {shape}: the last axis must be x, y, z")
