"""The scalar field of a model for marching cubes, and the protocol of such fields."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..field import interpret
from ..ir.lower import lower
from ..model.model import Model
from .surface import Array


class Field(Protocol):
    """A scalar field with a zero level set."""

    chunk: int
    """Number of points per call for the best speed."""

    def value(self, points: Array) -> Array:
        """Evaluate the field: (N,) float32, negative inside, at points (N, 3) float32 in model space."""
        ...

    def clearance(self, points: Array) -> Array:
        """Return a lower bound of the distance to the surface: (N,), 0 where unknown; points: (N, 3), model space."""
        ...


CACHED = 2**17
"""Number of values of a layer that fit the cache of a core."""
TRUSTED = 2.0
"""The next level's value serves as a bound up to |f_i| = TRUSTED * delta_i.

f_{i+1} is trained up to delta_i alone, but continues smoothly a little beyond.
"""


class ModelField:
    """The nested levels of a model (Section 3.2, Eq. 3) as a field for one grid.

    Marching cubes needs the last level at all corners of a crossed cell, also at corners just outside a band. So
    `value` widens the band of level i by lipschitz_i times a cell's diagonal: f_i changes by no more between two
    corners.
    """

    def __init__(self, model: Model, cell: float, time: float = 0.0) -> None:
        """cell: diagonal of a cell, model units; infinity: evaluate the last level everywhere.

        time: time of a moving model.
        """
        self.program = lower(model)
        self._time = time
        width = max(len(layer.bias) for network in model.networks().values() for layer in network)
        self.chunk = max(CACHED // width, 256)
        self._levels = len(model.levels)
        self._slopes = [level.lipschitz for level in model.levels]
        self._deltas = [level.delta for level in model.levels[:-1]]
        self._margins = [slope * cell for slope in self._slopes[:-1]]
        self._trusted_margins = [(TRUSTED - 1) * delta for delta in self._deltas]

    def value(self, points: Array) -> Array:
        """Evaluate the finest defined level, with widened bands: (N,) at points (N, 3) float32."""
        value, _ = interpret.nested_field(self.program, points, self._levels, self._time, self._margins)
        return value

    def clearance(self, points: Array) -> Array:
        """Return a lower bound of the distance to the surface: (N,) for points (N, 3).

        By Lipschitz factors, each level bounds the distance to its band, and the last level that to the surface.
        """
        clearance = np.zeros(len(points), np.float32)
        levels = interpret.nested_levels(self.program, points, self._levels, self._time, self._trusted_margins)
        for (near, value), delta, slope in zip(levels, [*self._deltas, 0.0], self._slopes, strict=True):
            distance = (np.abs(value) - np.float32(delta)) / np.float32(slope)
            clearance[near] = np.maximum(clearance[near], distance)
        return clearance

    def on_surface(self, points: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the last level's unit gradient (N, 3) at points (N, 3), and whether it is in every band (N,)."""
        gradient, _ = interpret.field_gradient(self.program, points, self._levels, self._time)
        return gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12), self.in_bands(points)

    def in_bands(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (N, 3) are in every band, where the last level is defined: (N,)."""
        _, reached = interpret.nested_field(self.program, points, self._levels, self._time)
        return np.asarray(reached == self._levels)

    def color(self, points: Array) -> Array:
        """Return the color (N, 3), sRGB in [0, 1], at points (N, 3). Raises ValueError if the model has no texture."""
        return interpret.color(self.program, points, self._time)
