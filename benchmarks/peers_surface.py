"""Measures a surface against the true one: the same code for all methods of benchmarks/peers.py."""

from collections.abc import Callable
from dataclasses import dataclass

import igl
import numpy as np

from mplicits.mesher.metrics import angles
from mplicits.readers.values import Doubles, Integers
from mplicits.trainer.shapes.shape import unit

Paint = Callable[[Doubles, Integers, Doubles], Doubles]
"""(points (N, 3), their faces (N,), barycentric coordinates (N, 3)) -> colors (N, 3), sRGB in [0, 1]."""

SAMPLES = 30_000
"""Points of each surface that are compared."""


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a surface, with the normals and the colors that are shown there."""

    places: Doubles
    """(N, 3)."""
    normals: Doubles
    """(N, 3) unit normals."""
    colors: Doubles | None
    """(N, 3), sRGB in [0, 1]; None without colors."""


class Surface:
    """Triangles with normals at their corners, and colors if there are some."""

    def __init__(self, vertices: Doubles, faces: Integers, normals: Doubles, paint: Paint | None = None) -> None:
        """vertices: (V, 3). faces: (F, 3). normals: (F, 3, 3), at the corners. Faces without area are dropped."""
        corners = vertices[faces]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        self.kept = np.flatnonzero(areas > 0)
        self.vertices = np.ascontiguousarray(vertices, np.float64)
        self.faces = np.ascontiguousarray(faces[self.kept], np.int64)
        self._normals, self._paint, self._areas = normals[self.kept], paint, np.cumsum(areas[self.kept])
        self._tree = igl.AABB()
        self._tree.init(self.vertices, self.faces)

    def sample(self, count: int, rng: np.random.Generator) -> Points:
        """Draw points, uniform by area."""
        face = np.searchsorted(self._areas, rng.random(count) * self._areas[-1], side="right")
        u, v = rng.random((2, count))
        u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
        weights = np.stack((1 - u - v, u, v), axis=1)
        return self._points(np.einsum("nk,nki->ni", weights, self.vertices[self.faces[face]]), face, weights)

    def nearest(self, places: Doubles) -> Points:
        """Return the nearest points of the surface to places (N, 3)."""
        _, face, closest = self._tree.squared_distance(self.vertices, self.faces, places)
        closest, face = np.ascontiguousarray(closest), np.asarray(face, np.int64)
        a, b, c = (np.ascontiguousarray(self.vertices[self.faces[face, k]]) for k in range(3))
        return self._points(closest, face, np.nan_to_num(np.asarray(igl.barycentric_coordinates(closest, a, b, c))))

    def _points(self, places: Doubles, face: Integers, weights: Doubles) -> Points:
        normals = unit(np.einsum("nk,nki->ni", weights, self._normals[face]))
        return Points(places, normals, None if self._paint is None else self._paint(places, self.kept[face], weights))


@dataclass(frozen=True)
class Errors:
    """How far a surface is from the true one: means over both directions."""

    distance: float
    """Mean distance of the points of one surface to the other, model units."""
    angle: float
    """Mean angle between the normals of these points and of the nearest ones, degrees."""
    color: float | None
    """Root mean square difference of their colors, of 255; None where one of the two has none."""


class Truth:
    """A true surface."""

    def __init__(self, surface: Surface, samples: int = SAMPLES, seed: int = 0) -> None:
        """samples: points of each surface that are compared."""
        self.surface, self._samples, self._seed = surface, samples, seed
        self._points = surface.sample(samples, np.random.default_rng(seed))

    def errors(self, other: Surface) -> Errors:
        """Compare a surface with the true one."""
        drawn = other.sample(self._samples, np.random.default_rng(self._seed + 1))
        pairs = ((self._points, other.nearest(self._points.places)), (drawn, self.surface.nearest(drawn.places)))
        squares = [
            np.square(here.colors - there.colors).mean()
            for here, there in pairs
            if here.colors is not None and there.colors is not None
        ]
        return Errors(
            float(np.mean([np.linalg.norm(here.places - there.places, axis=1).mean() for here, there in pairs])),
            float(np.mean([angles(here.normals, there.normals).mean() for here, there in pairs])),
            255 * float(np.sqrt(np.mean(squares))) if squares else None,
        )
