"""The scalar fields that a surface can be extracted from, and the one of a trained model."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..field import interpret
from ..ir.lower import lower
from ..model.model import Model
from .surface import Array


class Field(Protocol):
    """A scalar field whose zero level set is extracted."""

    chunk: int
    """How many points the field is best asked for at a time."""

    def value(self, points: Array) -> Array:
        """Evaluate the field: (N,) float32, negative inside, at points (N, 3) float32 in model space."""
        ...

    def clearance(self, points: Array) -> Array:
        """Bound the distance to the surface from below.

        points: (N, 3) float32, model space. Returns distances (N,) within which the value keeps its sign; 0 where none
        is known.
        """
        ...


CACHED = 2**17
"""How many values of one layer stay in a core's cache."""
TRUSTED = 2.0
"""Up to |f_i| = TRUSTED * delta_i, the next level's value is taken as a bound, though it is defined up to delta_i only.

Outside the band nothing was trained, but f_{i+1} goes on smoothly there for a little.
"""


class ModelField:
    """The nested levels of a model (Section 3.2, Eq. 3) as a field for one grid.

    Marching cubes needs the last level's value at all corners of a cell that the surface passes, also at those that lie
    just outside a band. So `value` widens the band of level i by lipschitz_i times a cell's diagonal, which is the most
    that f_i changes between two corners. Elsewhere a vertex has the value of the finest level that is defined there.
    """

    def __init__(self, model: Model, cell: float, time: float = 0.0) -> None:
        """Prepare a model.

        cell: the diagonal of the grid's cells, model units; with infinity the last level is evaluated everywhere.
        time: the fourth input of a model that moves.
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
        """Evaluate the finest level that is defined, with widened bands: (N,) at points (N, 3) float32."""
        value, _ = interpret.nested_field(self.program, points, self._levels, self._time, self._margins)
        return value

    def clearance(self, points: Array) -> Array:
        """Bound the distance to the surface from below, by the levels' Lipschitz factors: (N,) for points (N, 3).

        A level before the last says how far its band is. The last level, near every band, says how far its surface is.
        """
        clearance = np.zeros(len(points), np.float32)
        levels = interpret.nested_levels(self.program, points, self._levels, self._time, self._trusted_margins)
        for (near, value), delta, slope in zip(levels, [*self._deltas, 0.0], self._slopes, strict=True):
            distance = (np.abs(value) - np.float32(delta)) / np.float32(slope)
            clearance[near] = np.maximum(clearance[near], distance)
        return clearance

    def on_surface(self, points: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the last level's unit gradient (N, 3) at points (N, 3), and whether each is inside every band (N,)."""
        gradient, _ = interpret.field_gradient(self.program, points, self._levels, self._time)
        return gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12), self.in_bands(points)

    def in_bands(self, points: Array) -> NDArray[np.bool_]:
        """Tell which points (N, 3) are inside every band, where the last level is defined: (N,)."""
        _, reached = interpret.nested_field(self.program, points, self._levels, self._time)
        return np.asarray(reached == self._levels)

    def colour(self, points: Array) -> Array:
        """Return the colour (N, 3), sRGB in [0, 1], at points (N, 3). Raises ValueError if the model has no texture."""
        return interpret.colour(self.program, points, self._time)
