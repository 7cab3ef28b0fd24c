"""A model as a function: of points, which have a distance, a gradient and a colour, and of rays, which meet it."""

from functools import cached_property
from typing import TYPE_CHECKING, overload

import numpy as np

from ..codegen.printers.field import PLAIN
from ..field.evaluate import Evaluator
from ..field.hits import Hits
from ..model.errors import UserError
from ..model.model import Model
from .placement import Array, Placement, Points, as_tensor, numbers

if TYPE_CHECKING:
    from ..trainer.networks.by_arrays import ArrayField
    from ..trainer.networks.differentiable import Tensor, TorchField


class FieldFunction:
    """What `Field` is to those who ask it: its class says how."""

    def __init__(self, model: Model) -> None:
        """model: as `mplicits.model.model_file.load` reads it."""
        self.model = model
        self._evaluator = Evaluator(model)

    @cached_property
    def _torch(self) -> "TorchField | ArrayField":
        if self.model.scene is not None:
            from ..trainer.networks.by_arrays import ArrayField

            return ArrayField(self._evaluator)
        from ..trainer.networks.differentiable import TorchField

        return TorchField(self.model)

    @overload
    def __call__(
        self, points: "Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Tensor": ...

    @overload
    def __call__(
        self, points: Points, level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> Array: ...

    def __call__(
        self, points: "Points | Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Array | Tensor":
        """Evaluate the signed distance; see `sdf`."""
        return self.sdf(points, level, space=space, time=time)

    @overload
    def sdf(
        self, points: "Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Tensor": ...

    @overload
    def sdf(self, points: Points, level: int | None = None, *, space: str = "model", time: float = 0.0) -> Array: ...

    def sdf(
        self, points: "Points | Tensor", level: int | None = None, *, space: str = "model", time: float = 0.0
    ) -> "Array | Tensor":
        """Evaluate the signed distance at points (..., 3): (...) float32, negative inside.

        It is the finest level's that is defined at a point (Eq. 3), up to `level`. Finer levels are evaluated only
        where their band is, in chunks, on all cores.
        """
        place = Placement(self.model, space)
        if (tensor := as_tensor(points)) is not None:
            return self._torch.value(place.tensor(tensor), level, time).reshape(tensor.shape[:-1]) * place.scale
        rows, shape = place.rows(points)
        value = self._evaluator.value(rows, level, time).reshape(shape)
        return value if place.scale == 1 else value * np.float32(place.scale)

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
        """Evaluate the gradient of `sdf` at points (..., 3): (..., 3) float32, nearly of length 1.

        On the surface it is the outward normal. It comes from the networks' own adjoint pass, not from differences.
        """
        place = Placement(self.model, space)
        if (tensor := as_tensor(points)) is not None:
            slopes = self._torch.gradient(place.tensor(tensor), level, time)
            return place.tensor_turned_back(slopes).reshape(tensor.shape)
        rows, shape = place.rows(points)
        return place.turned_back(self._evaluator.gradient(rows, level, time)).reshape(*shape, 3)

    @overload
    def color(self, points: "Tensor", *, space: str = "model", time: float = 0.0) -> "Tensor": ...

    @overload
    def color(self, points: Points, *, space: str = "model", time: float = 0.0) -> Array: ...

    def color(self, points: "Points | Tensor", *, space: str = "model", time: float = 0.0) -> "Array | Tensor":
        """Evaluate the colour at points (..., 3), which is meant for the surface: (..., 3) float32, sRGB in [0, 1].

        A model without a texture has the one colour that all pictures paint it in.
        """
        place = Placement(self.model, space)
        plain = [float(channel) for channel in PLAIN.split(",")]
        if (tensor := as_tensor(points)) is not None:
            colours = self._torch.colour(place.tensor(tensor), time)
            if colours is None:
                return tensor.new_tensor(plain).expand(tensor.shape)
            return colours.reshape(tensor.shape)
        rows, shape = place.rows(points)
        values = self._evaluator.colour(rows, time)
        values = np.tile(np.array(plain, np.float32), (len(rows), 1)) if values is None else values
        return values.reshape(*shape, 3)

    def trace(
        self,
        origins: Points,
        directions: Points,
        level: int | None = None,
        *,
        space: str = "model",
        time: float = 0.0,
    ) -> Hits:
        """Find where rays meet the surface first.

        origins, directions: (..., 3), which are broadcast; directions of any length but 0. A ray that begins inside
        the shape meets it at its origin. The surface is looked for in the unit ball and a little beyond.
        """
        from ..field.trace import trace

        place = Placement(self.model, space)
        level = self._evaluator.checked(level)
        starts, along = (
            array.astype(np.float64) for array in np.broadcast_arrays(numbers(origins), numbers(directions))
        )
        shape = starts.shape[:-1]
        starts, along = starts.reshape(-1, 3), along.reshape(-1, 3)
        lengths = np.linalg.norm(along, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise UserError("directions: one is of length 0, or not a number")
        along = along / lengths
        placed, turned = place.into_model(starts), place.turned(along)
        t = trace(self.model, self._evaluator, placed, turned, level, time)
        hit = np.isfinite(t)
        met, normals = np.full(starts.shape, np.nan), np.full(starts.shape, np.nan, np.float32)
        at = placed[hit] + t[hit, None] * turned[hit]
        gradient = self._evaluator.gradient(at, level, time).astype(np.float64)
        gradient /= np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12)
        normals[hit] = place.turned_back(gradient)
        t *= place.scale
        met[hit] = starts[hit] + t[hit, None] * along[hit]
        return Hits(hit.reshape(shape), t.reshape(shape), met.reshape(*shape, 3), normals.reshape(*shape, 3))
