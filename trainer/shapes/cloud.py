"""An oriented point cloud as a shape: the input of the paper."""

from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...model.errors import UserError
from .shape import Doubles, Surface, normalise, unit

HELD_OUT = 0.05
"""Share of the points kept for evaluation."""
NEIGHBOURS = 8
TRUSTED = 8.0
"""Spacings from the cloud at which its nearest point is as far as the surface, to 1 % (half a squared ratio)."""


class CloudShape:
    """Points with outward normals, normalised.

    Distance is that to the nearest point, as in the paper; its sign is that of the cloud's winding number (Barill et
    al. 2018), each point weighted with the area of the disc that its nearest neighbours span. Raises UserError where
    there are too few points, values that are not finite, normals of zero length, or no extent.
    """

    def __init__(
        self, points: Doubles, normals: Doubles, colours: Doubles | None, name: str, source: dict[str, Any]
    ) -> None:
        if len(points) < 100:
            raise UserError(f"{name}: {len(points)} points; a cloud needs at least 100")
        if not (np.isfinite(points).all() and np.isfinite(normals).all()):
            raise UserError(f"{name}: coordinates or normals that are not finite (NaN or infinity); repair the file")
        if not np.ptp(points, axis=0).max() > 0:
            raise UserError(f"{name}: all points are one point; nothing to train on")
        if not (np.linalg.norm(normals, axis=1) > 0).all():
            raise UserError(f"{name}: normals of length zero; a cloud needs a normal at every point")
        positions, self.centre, self.scale = normalise(points)
        self.name, self.source, self.coloured = name, source, colours is not None
        self.warnings: list[str] = []
        order = np.random.default_rng(0).permutation(len(points))
        everything = Surface(positions, unit(normals), colours)
        split = max(1, int(len(points) * HELD_OUT))
        self._held_out, self._kept = _pick(everything, order[:split]), _pick(everything, order[split:])
        self._tree = cKDTree(self._kept.points)
        span = np.asarray(self._tree.query(self._kept.points, k=[NEIGHBOURS + 1], workers=-1)[0])[:, 0]
        self.resolution = TRUSTED * float(np.median(span)) / NEIGHBOURS**0.5
        self._areas = np.pi * span**2 / NEIGHBOURS
        indices, children, _, _ = igl.octree(self._kept.points)
        cloud = self._kept.points, self._kept.normals, self._areas, indices, children
        self._winding = (*cloud, *igl.fast_winding_number_precompute(*cloud))

    def surface(self, count: int, rng: np.random.Generator, held_out: bool = False) -> Surface:
        """`count` of the points, each as often as the others where there are fewer."""
        cloud = self._held_out if held_out else self._kept
        size = len(cloud.points)
        rounds = -(-count // size)
        chosen = np.concatenate([rng.permutation(size) for _ in range(rounds)])[:count]
        return _pick(cloud, chosen)

    def inputs(self) -> Doubles:
        """The points that training sees."""
        return self._kept.points

    def distance(self, points: Doubles) -> Doubles:
        """Distance to the nearest point of the cloud, signed by the winding number."""
        winding = igl.fast_winding_number(*self._winding, points)
        return np.where(winding > 0.5, -1.0, 1.0) * self.clearance(points)

    def clearance(self, points: Doubles) -> Doubles:
        """Distance to the nearest point of the cloud."""
        return np.asarray(self._tree.query(points, workers=-1)[0])


def _pick(surface: Surface, index: NDArray[np.int64]) -> Surface:
    colours = None if surface.colours is None else surface.colours[index]
    return Surface(surface.points[index], surface.normals[index], colours)
