"""Evaluates a model: distance, gradient and color at points, and the intersections of rays."""

from functools import cached_property
from typing import TYPE_CHECKING, overload

import numpy as np

from ..codegen.printers.field import PLAIN
from ..field.evaluate import Evaluator
from ..field.hits import Hits
from ..model.errors import UserError
from ..model.files import show_value
from ..model.model import Model
from .space import Array, Points, Space, arrays, as_tensor, checked_time

if TYPE_CHECKING:
    from ..trainer.networks.array_field import ArrayField
    from ..trainer.networks.torch_field import Tensor, TorchField


class FieldFunction:
    """The part of `Field` that evaluates the model."""

    def __init__(self, model: Model) -> None:
        """model: as `mplicits.model.model_file.load` reads it."""
        if not isinstance(model, Model):
            raise UserError(f"model {show_value(model)}: mplicits.load and mplicits.train make a Field")
        self.model = model
        self._evaluator = Evaluator(model)

    @cached_property
    def _torch(self) -> "TorchField | ArrayField":
        if self.model.scene is not None:
            from ..trainer.networks.array_field import ArrayField

            return ArrayField(self._evaluator)
        from ..trainer.networks.torch_field import TorchField

        return TorchField(self.model)

    def _asked(self, space: str, level: int | None, time: float) -> tuple[Space, int, float]:
        """Check the arguments that all functions share, and return the frame, the level and the time."""
        return Space(self.model, space), self._evaluator.checked(level), checked_time(time, self.model)

    @overload
    def sdf(
        self, points: "Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Tensor": ...

    @overload
    def sdf(self, points: Points, level: int | None = None, *, space: str = "model", time: float = 0.0) -> Array: ...

    def sdf(
        self, points: "Points | Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Array | Tensor":
        """Evaluate the signed distance at points (..., 3): (...) float32, negative inside; Eq. 3.

        Each finer level, up to `level`, is evaluated only in its band; on all cores, in chunks of bounded memory.
        """
        frame, level, time = self._asked(space, level, time)
        if (tensor := as_tensor(points)) is not None:
            return (
                self._torch.value(frame.tensor_to_model(tensor), level, time).reshape(tensor.shape[:-1]) * frame.scale
            )
        rows, shape = frame.rows(points)
        value = self._evaluator.value(rows, level, time).reshape(shape)
        return value if frame.scale == 1 else value * np.float32(frame.scale)

    __call__ = sdf

    @overload
    def gradient(
        self, points: "Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Tensor": ...

    @overload
    def gradient(
        self, points: Points, level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> Array: ...

    def gradient(
        self, points: "Points | Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Array | Tensor":
        """Evaluate the gradient of `sdf` at points (..., 3): (..., 3) float32, of length about 1, by back-propagation.

        On the surface it is the outward normal.
        """
        frame, level, time = self._asked(space, level, time)
        if (tensor := as_tensor(points)) is not None:
            slopes = self._torch.gradient(frame.tensor_to_model(tensor), level, time)
            return frame.tensor_from_model(slopes).reshape(tensor.shape)
        rows, shape = frame.rows(points)
        return frame.directions_from_model(self._evaluator.gradient(rows, level, time)).reshape(*shape, 3)

    @overload
    def color(self, points: "Tensor", *, space: str = "model", time: float = 0.0) -> "Tensor": ...

    @overload
    def color(self, points: Points, *, space: str = "model", time: float = 0.0) -> Array: ...

    def color(self, points: "Points | Tensor", *, space: str = "model", time: float = 0.0) -> "Array | Tensor":
        """Evaluate the color at points (..., 3) near the surface: (..., 3) float32, sRGB in [0, 1].

        A model without a texture has the plain color of its pictures everywhere.
        """
        frame, _, time = self._asked(space, None, time)
        plain = [float(channel) for channel in PLAIN.split(",")]
        if (tensor := as_tensor(points)) is not None:
            colors = self._torch.color(frame.tensor_to_model(tensor), time)
            if colors is None:
                return tensor.float().new_tensor(plain).expand(tensor.shape)
            return colors.reshape(tensor.shape)
        rows, shape = frame.rows(points)
        values = self._evaluator.color(rows, time)
        values = np.tile(np.array(plain, np.float32), (len(rows), 1)) if values is None else values
        return values.reshape(*shape, 3)

    def trace(
        self, origins: Points, directions: Points, level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> Hits:
        """Find the first intersections of rays with the surface, in the unit ball and a little beyond.

        origins, directions: (..., 3), broadcast against each other; directions of any length but 0. A ray that starts
        inside the shape intersects it at its origin.
        """
        from ..field.trace import trace

        frame, level, time = self._asked(space, level, time)
        rays = arrays(origins, "origins"), arrays(directions, "directions")
        try:
            both = np.broadcast_arrays(*rays)
        except ValueError:
            raise UserError(
                f"origins and directions: shapes {rays[0].shape} and {rays[1].shape} do not match"
            ) from None
        shape = both[0].shape[:-1]
        starts, along = (array.astype(np.float64).reshape(-1, 3) for array in both)
        lengths = np.linalg.norm(along, axis=1, keepdims=True)
        if not ((lengths > 0) & (lengths < np.inf)).all():
            raise UserError("directions: one is of length 0, infinite, or not a number")
        along /= lengths
        model_starts, model_along = frame.to_model(starts), frame.directions_to_model(along)
        t = trace(self.model, self._evaluator, model_starts, model_along, level, time)
        hit = np.isfinite(t)
        points, normals = np.full(starts.shape, np.nan), np.full(starts.shape, np.nan, np.float32)
        surface = model_starts[hit] + t[hit, None] * model_along[hit]
        gradient = self._evaluator.gradient(surface, level, time).astype(np.float64)
        gradient /= np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12)
        normals[hit] = frame.directions_from_model(gradient)
        t *= frame.scale
        points[hit] = starts[hit] + t[hit, None] * along[hit]
        return Hits(hit.reshape(shape), t.reshape(shape), points.reshape(*shape, 3), normals.reshape(*shape, 3))
