"""A trained model as a field to extract a surface from."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..codegen.ir.lower import lower
from ..codegen.ir.program import Function
from ..codegen.reference import interpret
from ..model.model import Model
from .surface import Array


class Field(Protocol):
    """What a surface is extracted from. chunk: how many points it likes to be asked for at a time."""

    chunk: int

    def value(self, points: Array) -> Array:
        """Value (N,) float32 at points (N, 3) float32, model space; negative inside."""
        ...

    def clearance(self, points: Array) -> Array:
        """A distance (N,) around each point within which the value keeps its sign; 0 where that is not known."""
        ...


CACHED = 2**17
"""Numbers of one layer that stay in a core's cache."""
SHELL = 2.0
"""How many half widths of its band a level tells about the surface: its sum goes on smoothly a little outside."""


class ModelField:
    """The nested levels of a model (Section 3.2, Eq. 3), for a grid whose cells have the diagonal `cell`.

    A vertex takes the last level's value wherever a cell that meets every band can have it as a corner: there
    |f_i| < delta_i + lipschitz_i * cell for every level i before the last. Elsewhere it keeps f_i, the finest level
    that is defined. Cells with surface in them so have the last level's values at all corners, as if it were evaluated
    everywhere; which it is with a `cell` of infinity. time: the fourth input of a model that moves.
    """

    def __init__(self, model: Model, cell: float, time: float = 0.0) -> None:
        self.program = lower(model)
        self._time = time
        width = max(len(layer.bias) for level in model.levels for layer in level.network)
        self.chunk = max(CACHED // width, 256)
        self._slopes = [level.lipschitz for level in model.levels]
        self._deltas = [level.delta for level in model.levels[:-1]]
        self._reach = [delta + slope * cell for delta, slope in zip(self._deltas, self._slopes[:-1], strict=True)]

    def value(self, points: Array) -> Array:
        """The value (N,) at points (N, 3) float32, model space."""
        inputs = self._inputs(points)
        value = self._run(self.program.values[0], inputs)
        inside = np.arange(len(points))
        for function, reach in zip(self.program.values[1:], self._reach, strict=True):
            inside = inside[np.abs(value[inside]) < reach]
            value[inside] += self._run(function, inputs[inside])
        return value

    def clearance(self, points: Array) -> Array:
        """How far from points (N, 3) no surface is, by the Lipschitz factors: (N,).

        By f_i: how far it is to its band. By the last level, near every band: how far to its surface.
        """
        inputs = self._inputs(points)
        value, clearance = np.zeros(len(points), np.float32), np.zeros(len(points), np.float32)
        near = np.arange(len(points))
        for function, delta, slope in zip(self.program.values, [*self._deltas, 0.0], self._slopes, strict=True):
            value[near] += self._run(function, inputs[near])
            f = np.abs(value[near])
            clearance[near] = np.maximum(clearance[near], (f - np.float32(delta)) / np.float32(slope))
            near = near[f < SHELL * delta]
        return clearance

    def on_surface(self, points: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Unit gradient (N, 3) of the last level, and whether each point (N, 3) is inside every band."""
        inputs = self._inputs(points)
        value, gradient = np.zeros(len(points), np.float32), np.zeros((len(points), 3), np.float32)
        inside = np.ones(len(points), bool)
        for function, delta in zip(self.program.gradients, [*self._deltas, np.inf], strict=True):
            part, f = interpret.run(self.program, function, inputs)
            value, gradient = value + f[:, 0], gradient + part[:, :3]
            inside &= np.abs(value) < delta
        return gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12), inside

    def colour(self, points: Array) -> Array:
        """Colour (N, 3), sRGB in [0, 1], at points (N, 3). Raises ValueError where the model has no texture."""
        return interpret.colour(self.program, points, self._time)

    def _inputs(self, points: Array) -> Array:
        fourth = self._time if self.program.moving else 1.0
        return np.pad(points, ((0, 0), (0, 1)), constant_values=np.float32(fourth))

    def _run(self, function: Function, inputs: Array) -> Array:
        return interpret.run(self.program, function, inputs)[0][:, 0]
