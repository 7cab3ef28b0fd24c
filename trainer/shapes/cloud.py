"""An oriented point cloud as a shape to train on, which is the paper's input."""

from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ...model.errors import UserError
from .shape import Doubles, SurfacePoints, normalise, unit

HELD_OUT = 0.05
"""Share of the points kept for evaluation."""
FEWEST = 100
"""Fewest points of a cloud."""
NEIGHBOURS = 8
"""Nearest neighbours that the spacing of the points is measured with."""
TRUSTED = 8.0
"""Distance from the cloud, in spacings of its points, at which the nearest point is as far as the surface to 1 %.

The error is half the squared ratio of the two.
"""


class CloudShape:
    """A `Shape` of points with outward normals, normalised.

    The distance is that to the nearest point, as in the paper. Its sign is that of the cloud's winding number (Barill
    et al. 2018), for which each point is weighted with the area of the disc that its nearest neighbours span.
    """

    def __init__(
        self, points: Doubles, normals: Doubles, colours: Doubles | None, name: str, source: dict[str, Any]
    ) -> None:
        """points, normals: (N, 3), input space; normals of any length. colours: (N, 3) sRGB in [0, 1], or None.

        Raises UserError where there are too few points, values that are not finite, normals of zero length, or where
        all points are one.
        """
        if len(points) < FEWEST:
            raise UserError(f"{name}: {len(points)} points; a cloud needs at least {FEWEST}")
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
        everything = SurfacePoints(positions, unit(normals), colours)
        split = max(1, int(len(points) * HELD_OUT))
        self._held_out, self._kept = _pick(everything, order[:split]), _pick(everything, order[split:])
        self._tree = cKDTree(self._kept.points)
        span = np.asarray(self._tree.query(self._kept.points, k=[NEIGHBOURS + 1], workers=-1)[0])[:, 0]
        self.resolution = TRUSTED * float(np.median(span)) / NEIGHBOURS**0.5
        self._areas = np.pi * span**2 / NEIGHBOURS
        indices, children, _, _ = igl.octree(self._kept.points)
        cloud = self._kept.points, self._kept.normals, self._areas, indices, children
        self._winding = (*cloud, *igl.fast_winding_number_precompute(*cloud))

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw `count` of the points; where there are fewer, each comes as often as the others.

        held_out: draw from the points kept for evaluation, not from those that training sees. `colours` changes
        nothing: the points have theirs.
        """
        cloud = self._held_out if held_out else self._kept
        size = len(cloud.points)
        rounds = -(-count // size)
        index = np.concatenate([rng.permutation(size) for _ in range(rounds)])[:count]
        return _pick(cloud, index)

    def inputs(self) -> Doubles:
        """Return the points that training sees: (N, 3)."""
        return self._kept.points

    def distance(self, points: Doubles) -> Doubles:
        """Compute the distance to the nearest point of the cloud, signed by the winding number. Returns (N,)."""
        winding = igl.fast_winding_number(*self._winding, points)
        return np.where(winding > 0.5, -1.0, 1.0) * self.clearance(points)

    def clearance(self, points: Doubles) -> Doubles:
        """Compute the distance to the nearest point of the cloud. Returns (N,)."""
        return np.asarray(self._tree.query(points, workers=-1)[0])


def _pick(surface: SurfacePoints, index: NDArray[np.int64]) -> SurfacePoints:
    colours = None if surface.colours is None else surface.colours[index]
    return SurfacePoints(surface.points[index], surface.normals[index], colours)
