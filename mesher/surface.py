"""A triangle mesh in model space."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float32]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """vertices: (V, 3) float32, model space; faces: (F, 3) int64, counter-clockwise seen from outside.

    normals: (V, 3) float32 of length 1, or None; colours: (V, 3) float32, sRGB in [0, 1], or None.
    """

    vertices: Array
    faces: Whole
    normals: Array | None = None
    colours: Array | None = None

    def components(self) -> tuple[int, Whole]:
        """Number of connected components, and the one that each vertex belongs to, (V,)."""
        size = len(self.vertices)
        one, other = self.faces[:, :2].ravel(), self.faces[:, 1:].ravel()
        edges = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(size, size))
        count, labels = connected_components(edges, directed=False)
        return int(count), labels.astype(np.int64)

    def only(self, wanted: NDArray[np.bool_]) -> "Mesh":
        """The vertices for which `wanted` (V,) holds, and the faces between them."""
        new = np.cumsum(wanted) - 1
        faces = new[self.faces[wanted[self.faces].all(axis=1)]]
        normals, colours = (None if a is None else a[wanted] for a in (self.normals, self.colours))
        return Mesh(self.vertices[wanted], faces, normals, colours)
