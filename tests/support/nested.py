"""Compares the surface that culling finds with that of the last level evaluated at every vertex of the grid."""

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
"""How far apart the same vertex of both surfaces may be, in sides of a cell, beside what rounding does."""
ROUNDING = 1e-6
"""How far |f| at a vertex of the grid may be off by rounding alone.

The last digits of float32 products depend on how many points are evaluated together (3.5e-7 was seen). Where |f| is
smaller than this, rounding decides on its sign, and so on which edges are crossed. A vertex on an edge moves by this
over the difference of f at the ends of the edge, which is small where the edge grazes the surface.
"""


@dataclass
class Comparison:
    """The vertices of the two surfaces, without those that rounding alone can move farther than TOLERANCE."""

    vertices: int
    """Vertices that both surfaces have."""
    missing: int
    """Vertices of the last level's surface that the culled one lacks."""
    extra: int
    """Vertices of the culled surface that the last level's lacks."""
    spurious: int
    """Components of the last level's surface that lie outside the bands. They are not compared."""


def same_vertices(model: Model, resolution: int) -> Comparison:
    """Compare the vertices of the two surfaces; the same vertex is one within TOLERANCE and what rounding moves it."""
    field = ModelField(model, math.inf)
    dense = extract(field, resolution, cull=False)
    _, inside = field.on_surface(dense.vertices)
    count, component = dense.components()
    nested = np.zeros(count, np.bool_)
    nested[component[inside]] = True
    everywhere, culled = dense.only(nested[component]).vertices, extract_model(model, resolution).mesh.vertices
    grid = Grid(resolution)
    missing, extra = (_alone(field, grid, *pair) for pair in ((everywhere, culled), (culled, everywhere)))
    return Comparison(len(everywhere) - missing, missing, extra, int(count - nested.sum()))


def _alone(field: ModelField, grid: Grid, here: Array, there: Array) -> int:
    """Count the vertices `here` (N, 3) that are not among those `there` (M, 3), where rounding does not explain it."""
    apart = np.asarray(cKDTree(there).query(here)[0]) / grid.side
    far = apart > TOLERANCE
    low, high = _ends(field, grid, here[far])
    decided = np.minimum(low, high) > ROUNDING
    return int(np.count_nonzero(decided & (apart[far] > TOLERANCE + ROUNDING / np.maximum(low + high, ROUNDING))))


def _ends(field: ModelField, grid: Grid, vertices: Array) -> tuple[Array, Array]:
    """Evaluate |f| at both ends of the edges of the grid that vertices (N, 3) lie on: (N,) for each end."""
    places = (vertices.astype(np.float64) + EXTENT) / grid.side
    low = np.rint(places)
    along = np.abs(places - low).argmax(axis=1)
    rows = np.arange(len(places))
    low[rows, along] = np.floor(places[rows, along])
    high = low.copy()
    high[rows, along] += 1
    first, second = (np.abs(field.value((ends * grid.side - EXTENT).astype(np.float32))) for ends in (low, high))
    return first, second
