"""The surface that culling finds against that of the last level evaluated at every vertex of the grid."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from codegen.model import Model
from mesher.extract import extract, extract_model
from mesher.field import ModelField
from mesher.grid import Grid

TOLERANCE = 1e-3
"""Cell sides: float32 products differ in the last digit with the number of points they are asked for."""


@dataclass
class Comparison:
    """vertices: of both. missing: vertices of the last level's surface that culling has not; extra: the reverse.

    Components of the last level's surface that lie outside the bands are left out, `spurious` of them.
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
    near = TOLERANCE * Grid(resolution).side
    missing, extra = (
        int(np.count_nonzero(cKDTree(there).query(here)[0] > near))
        for here, there in ((wanted, found), (found, wanted))
    )
    return Comparison(len(wanted) - missing, missing, extra, int(count - nested.sum()))
