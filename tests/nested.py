"""The surface that culling finds against that of the last level evaluated at every vertex of the grid."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from codegen.model import Model
from mesher.extract import extract, extract_model
from mesher.field import ModelField
from mesher.grid import EXTENT, Grid
from mesher.surface import Array

TOLERANCE = 1e-3
"""Cell sides: float32 products differ in the last digit with the number of points they are asked for."""
ROUNDING = 1e-6
"""Where |f| at a grid vertex is below this, those last digits decide on its sign, and so on which edges are crossed."""


@dataclass
class Comparison:
    """vertices: of both. missing: vertices of the last level's surface that culling has not; extra: the reverse.

    Components of the last level's surface that lie outside the bands are left out, `spurious` of them, and so are
    vertices on edges with an end where rounding decides on the sign.
    """

    vertices: int
    missing: int
    extra: int
    spurious: int


def same_vertices(model: Model, resolution: int) -> Comparison:
    """Compares vertices, which are the same within TOLERANCE."""
    field = ModelField(model, math.inf)
    dense = extract(field, resolution, cull=False)
    _, inside = field.on_surface(dense.vertices)
    count, component = dense.components()
    nested = np.zeros(count, np.bool_)
    nested[component[inside]] = True
    wanted, found = dense.only(nested[component]).vertices, extract_model(model, resolution).mesh.vertices
    grid = Grid(resolution)
    missing, extra = (
        int(np.count_nonzero(_decided(field, grid, here[cKDTree(there).query(here)[0] > TOLERANCE * grid.side])))
        for here, there in ((wanted, found), (found, wanted))
    )
    return Comparison(len(wanted) - missing, missing, extra, int(count - nested.sum()))


def _decided(field: ModelField, grid: Grid, vertices: Array) -> NDArray[np.bool_]:
    """Whether the field's sign is beyond rounding at both ends of the grid edges that vertices (N, 3) lie on: (N,)."""
    places = (vertices.astype(np.float64) + EXTENT) / grid.side
    low = np.rint(places)
    along = np.abs(places - low).argmax(axis=1)
    each = np.arange(len(places))
    low[each, along] = np.floor(places[each, along])
    high = low.copy()
    high[each, along] += 1
    least = np.full(len(places), np.inf)
    for ends in (low, high):
        least = np.minimum(least, np.abs(field.value((ends * grid.side - EXTENT).astype(np.float32))))
    return np.asarray(least > ROUNDING)
