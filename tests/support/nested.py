"""The surface that culling finds against that of the last level evaluated at every vertex of the grid."""

import math
from dataclasses import dataclass

import numpy as np
from mplicits.mesher.extract import extract, extract_model
from mplicits.mesher.field import ModelField
from mplicits.mesher.grid import EXTENT, Grid
from mplicits.mesher.surface import Array
from mplicits.model.model import Model
from scipy.spatial import cKDTree

TOLERANCE = 1e-3
"""Cell sides that the same vertex may be apart, beside what rounding does."""
ROUNDING = 1e-6
"""How far |f| at a grid vertex may be off: float32 products differ in the last digits with the number of points they
are asked for (3.5e-7 was seen). It decides on the sign where |f| is smaller, and so on which edges are crossed; and a
vertex on an edge moves by this over the difference of f at the edge's ends, which is small where the surface grazes."""


@dataclass
class Comparison:
    """vertices: of both. missing: vertices of the last level's surface that culling has not; extra: the reverse.

    Components of the last level's surface that lie outside the bands are left out, `spurious` of them, and so are
    vertices that rounding alone can move as far.
    """

    vertices: int
    missing: int
    extra: int
    spurious: int


def same_vertices(model: Model, resolution: int) -> Comparison:
    """Compares vertices, which are the same within TOLERANCE and what rounding moves them."""
    field = ModelField(model, math.inf)
    dense = extract(field, resolution, cull=False)
    _, inside = field.on_surface(dense.vertices)
    count, component = dense.components()
    nested = np.zeros(count, np.bool_)
    nested[component[inside]] = True
    wanted, found = dense.only(nested[component]).vertices, extract_model(model, resolution).mesh.vertices
    grid = Grid(resolution)
    missing, extra = (_alone(field, grid, *pair) for pair in ((wanted, found), (found, wanted)))
    return Comparison(len(wanted) - missing, missing, extra, int(count - nested.sum()))


def _alone(field: ModelField, grid: Grid, here: Array, there: Array) -> int:
    """How many vertices of `here` (N, 3) are not among those of `there` (M, 3)."""
    apart = np.asarray(cKDTree(there).query(here)[0]) / grid.side
    far = apart > TOLERANCE
    low, high = _ends(field, grid, here[far])
    decided = np.minimum(low, high) > ROUNDING
    return int(np.count_nonzero(decided & (apart[far] > TOLERANCE + ROUNDING / np.maximum(low + high, ROUNDING))))


def _ends(field: ModelField, grid: Grid, vertices: Array) -> tuple[Array, Array]:
    """|f| at both ends of the grid edges that vertices (N, 3) lie on: (N,) each."""
    places = (vertices.astype(np.float64) + EXTENT) / grid.side
    low = np.rint(places)
    along = np.abs(places - low).argmax(axis=1)
    each = np.arange(len(places))
    low[each, along] = np.floor(places[each, along])
    high = low.copy()
    high[each, along] += 1
    first, second = (np.abs(field.value((ends * grid.side - EXTENT).astype(np.float32))) for ends in (low, high))
    return first, second
