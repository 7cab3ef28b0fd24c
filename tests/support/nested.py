"""Compares the culled surface with the surface of the last level evaluated at every vertex of the grid."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mplicits.mesher.extract import extract, extract_model
from mplicits.mesher.grid import EXTENT, Grid
from mplicits.mesher.model_field import ModelField
from mplicits.mesher.surface import Array
from mplicits.model.model import Model

TOLERANCE = 1e-3
"""Largest distance between the same vertex of both surfaces, in sides of a cell, without rounding."""
ROUNDING = 1e-6
"""Largest rounding error of |f| at a vertex of the grid.

The last digits of float32 products depend on the number of points in a batch (3.5e-7 was measured). For smaller |f|,
rounding decides the sign, and so which edges are crossed. A vertex on an edge moves by this error over the difference
of f at the edge's ends, which is small where the edge grazes the surface.
"""


@dataclass
class Comparison:
    """The vertices of both surfaces, without those that rounding alone can move farther than TOLERANCE."""

    vertices: int
    """Vertices on both surfaces."""
    missing: int
    """Vertices only on the last level's surface."""
    extra: int
    """Vertices only on the culled surface."""
    spurious: int
    """Connected components of the last level's surface outside the bands, which are not compared."""


def same_vertices(model: Model, resolution: int) -> Comparison:
    """Compare the vertices of both surfaces. Equal vertices are within TOLERANCE and rounding."""
    field = ModelField(model, math.inf)
    dense = extract(field, resolution, cull=False)
    _, inside = field.on_surface(dense.vertices)
    count, component = dense.components()
    nested = np.zeros(count, np.bool_)
    nested[component[inside]] = True
    everywhere, culled = dense.only(nested[component]).vertices, extract_model(model, resolution).mesh.vertices
    grid = Grid(resolution)
    missing, extra = (_unmatched(field, grid, *pair) for pair in ((everywhere, culled), (culled, everywhere)))
    return Comparison(len(everywhere) - missing, missing, extra, int(count - nested.sum()))


def _unmatched(field: ModelField, grid: Grid, here: Array, there: Array) -> int:
    """Count the vertices `here` (N, 3) without a counterpart `there` (M, 3) that rounding does not explain."""
    apart = np.asarray(cKDTree(there).query(here)[0]) / grid.side
    far = apart > TOLERANCE
    low, high = _ends(field, grid, here[far])
    decided = np.minimum(low, high) > ROUNDING
    return int(np.count_nonzero(decided & (apart[far] > TOLERANCE + ROUNDING / np.maximum(low + high, ROUNDING))))


def _ends(field: ModelField, grid: Grid, vertices: Array) -> tuple[Array, Array]:
    """Return |f| at both ends of the grid edges with the vertices (N, 3): (N,) for each end."""
    places = (vertices.astype(np.float64) + EXTENT) / grid.side
    low = np.rint(places)
    along = np.abs(places - low).argmax(axis=1)
    rows = np.arange(len(places))
    low[rows, along] = np.floor(places[rows, along])
    high = low.copy()
    high[rows, along] += 1
    first, second = (np.abs(field.value((ends * grid.side - EXTENT).astype(np.float32))) for ends in (low, high))
    return first, second
