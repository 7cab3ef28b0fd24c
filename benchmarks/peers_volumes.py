"""Volumes of benchmarks/peers.py: a dense texture of distances, and screened Poisson reconstruction of a cloud."""

import gzip
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label, map_coordinates
from scipy.spatial import cKDTree

from mplicits.mesher.extract import extract
from mplicits.mesher.surface import Array
from mplicits.readers.values import Doubles
from mplicits.trainer.shapes.mesh import MeshShape
from mplicits.trainer.shapes.shape import unit
from peers_meshes import Triangles
from peers_surface import Points, Surface

NEAR = 3.0
"""Largest distance that a texel holds, in texels: what interpolation and normals at the surface need."""
MARGIN = 2
"""Texels around the shape's bounding box."""
LARGEST = 255
"""Value of a texel that is NEAR or farther outside; 0: inside."""
GRID = 256
"""Cells along each side of the grid that the texture's mesh is extracted from."""
CLOUD = 300_000
"""Points of the cloud for Poisson."""
DEPTH = 8
"""Of the octree of screened Poisson."""


@dataclass(frozen=True, eq=False)
class Texture:
    """Distances at the texels of a cube, 8 bits each; a field for `mesher.extract`."""

    texels: NDArray[np.uint8]
    """(n, n, n), x first."""
    lowest: Doubles
    """Center of the first texel, model space."""
    side: float
    """Distance of neighboring texels, model units."""
    chunk = 1 << 16

    @property
    def size(self) -> int:
        """Bytes in gzip."""
        return len(gzip.compress(self.texels.tobytes(), 9, mtime=0))

    def value(self, points: Array) -> Array:
        """Interpolate, as a GPU does: (N,) at points (N, 3), model space."""
        at = (points.astype(np.float64) - self.lowest) / self.side
        texel = map_coordinates(self.texels.astype(np.float32), at.T, order=1, mode="nearest")
        return np.asarray((2 * texel / LARGEST - 1) * NEAR * self.side, np.float32)

    def clearance(self, points: Array) -> Array:
        """Return a lower bound of the distance to the surface: (N,)."""
        return np.asarray(np.maximum(np.abs(self.value(points)) - self.side, 0), np.float32)

    def surface(self) -> Surface:
        """Return the zero level set, with normals by central differences over two texels."""
        mesh = extract(self, GRID)
        steps = self.side * np.eye(3, dtype=np.float32)
        slopes = [self.value(mesh.vertices + step) - self.value(mesh.vertices - step) for step in steps]
        normals = unit(np.stack(slopes, axis=1).astype(np.float64))
        return Surface(mesh.vertices.astype(np.float64), mesh.faces, normals[mesh.faces])


def texture(shape: MeshShape, truth: Points, count: int) -> Texture:
    """Measure the distances at the texels of a cube around a shape. truth: dense points of it. count: n of `Texture`.

    Texels that are NEAR or farther from the surface have one sign where they are connected.
    """
    low, high = truth.places.min(axis=0), truth.places.max(axis=0)
    side = float((high - low).max()) / (count - 1 - 2 * MARGIN)
    lowest = (low + high - side * (count - 1)) / 2
    places = lowest + side * np.moveaxis(np.indices((count,) * 3), 0, -1).reshape(-1, 3)
    reach = (NEAR + 1) * side
    far = ~np.isfinite(cKDTree(truth.places).query(places, distance_upper_bound=reach, workers=-1)[0])
    values = np.empty(len(places))
    values[~far] = shape.distance(places[~far])
    pieces, number = label(far.reshape((count,) * 3))
    first = np.unique(pieces.ravel(), return_index=True)[1][-number:] if number else np.empty(0, np.int64)
    signs = np.concatenate(([0.0], np.sign(shape.distance(places[first]))))
    values[far] = (signs[pieces.ravel()] * reach)[far]
    texels = np.rint((np.clip(values / (NEAR * side), -1, 1) + 1) / 2 * LARGEST).astype(np.uint8)
    return Texture(texels.reshape((count,) * 3), lowest, side)


def poisson(cloud: Points) -> Triangles:
    """Reconstruct a cloud with normals by screened Poisson (Kazhdan and Hoppe 2013), by MeshLab's code."""
    import pymeshlab

    work = pymeshlab.MeshSet()
    work.add_mesh(pymeshlab.Mesh(vertex_matrix=cloud.places, v_normals_matrix=cloud.normals))
    work.generate_surface_reconstruction_screened_poisson(depth=DEPTH, threads=1)
    result = work.current_mesh()
    return Triangles(result.vertex_matrix(), result.face_matrix().astype(np.int64)).welded()
