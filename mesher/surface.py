"""The triangle mesh of this room."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float32]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh in model space."""

    vertices: Array
    """(V, 3) float32, model space."""
    faces: Whole
    """(F, 3) int64 indices of vertices, counter-clockwise as seen from outside."""
    normals: Array | None = None
    """(V, 3) float32 unit normals, or None."""
    colors: Array | None = None
    """(V, 3) float32, sRGB in [0, 1], or None."""

    def components(self) -> tuple[int, Whole]:
        """Return the number of connected components, and the component of each vertex (V,)."""
        size = len(self.vertices)
        one, other = self.faces[:, :2].ravel(), self.faces[:, 1:].ravel()
        edges = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(size, size))
        count, labels = connected_components(edges, directed=False)
        return int(count), labels.astype(np.int64)

    def only(self, kept: NDArray[np.bool_]) -> "Mesh":
        """Return the submesh of the vertices where `kept` (V,) is true."""
        new_numbers = np.cumsum(kept) - 1
        faces = new_numbers[self.faces[kept[self.faces].all(axis=1)]]
        normals, colors = (None if a is None else a[kept] for a in (self.normals, self.colors))
        return Mesh(self.vertices[kept], faces, normals, colors)
