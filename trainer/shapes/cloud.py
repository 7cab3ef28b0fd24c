"""An oriented point cloud as a shape to train on: the input of the paper."""

from typing import Any

import igl
import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from .checks import check_count, name_first
from .cleaning import clean
from .duplicates import merge
from .planes import LocalPlanes, NearestPoint
from .reading_report import ReadingReport
from .shape import Doubles, SurfacePoints, in_cell_order, unit

HELD_OUT = 0.05  # share of the points that is held out for evaluation
NEIGHBORS = 12  # nearest neighbors from which the area of a point is estimated
COARSE = 1e-4
"""The winding number merges points closer than this share of the shape's size.

Each halving of a distance adds a level to its octree: a million points in close pairs would fill 25 GB.
"""
MOST_COARSE = 50_000
"""Most of these points, each of which takes 32 kB: more are merged. Near them, the planes give the sign."""
EVEN, EVEN_NEIGHBORS = 1.5, 64
"""In a noisy cloud, a point's spacing is at most this multiple of the median over this number of neighbors.

Without the limit, a stray point would leave a large region around it without a distance.
"""
OPEN = 0.3  # if the winding number differs from 1/2 by less, the cloud has a hole there, and the distance is unknown


class CloudShape:
    """A `Shape` of points with outward normals, in model space.

    The distance comes from the planes through the nearest points where these agree (`LocalPlanes`), and farther away
    from the nearest point, as in the paper, with the sign of the cloud's winding number (Barill et al. 2018).
    """

    cloud = True
    moving = False
    taken: ReadingReport | None = None

    def __init__(self, points: SurfacePoints, name: str, source: dict[str, Any], noise: float | None = None) -> None:
        """points: accepted by `check_cloud`, in input space, with normals of any length.

        noise: standard deviation of the points, as a share of the shape's radius; None: measure it (`cleaning.clean`).
        Raises UserError if too few points are left without duplicates, or without noise.
        """
        self.name, self.colored = name, points.colors is not None
        self.warnings: list[str] = []
        with name_first(name):
            merged = self._merged(SurfacePoints(points.points, unit(points.normals), points.colors))
            cloud = clean(merged, HELD_OUT, noise)
        self.center, self.scale, self.noise = cloud.center, cloud.scale, cloud.noise
        self._held_out, self._training = cloud.held_out, cloud.training
        self.source = source | ({"noise": cloud.record} if cloud.record else {})
        # With these options, queries far from a surface take about a tenth of the time.
        self._tree = cKDTree(self._training.points, balanced_tree=False, compact_nodes=False)
        spacings = np.sqrt(_areas(self._tree))
        self._near: LocalPlanes | NearestPoint
        if self.noise:
            self._near = NearestPoint(self._tree, self._evened(spacings))
        else:
            self._near = LocalPlanes(self._tree, self._training.normals, spacings)
        coarse, apart = merge(self._training, COARSE).surface, COARSE
        while len(coarse.points) > MOST_COARSE:
            apart *= 1.5
            coarse = merge(coarse, apart).surface
        indices, children, _, _ = igl.octree(coarse.points)
        weighted = coarse.points, coarse.normals, _areas(cKDTree(coarse.points)), indices, children
        self._winding = (*weighted, *igl.fast_winding_number_precompute(*weighted))

    def surface(self, count: int, rng: Generator, *, held_out: bool = False, colors: bool = False) -> SurfacePoints:
        """Draw `count` of the points, each equally often; colors are always included."""
        cloud = self._held_out if held_out else self._training
        size = len(cloud.points)
        rounds = -(-count // size)
        return cloud.take(np.concatenate([rng.permutation(size) for _ in range(rounds)])[:count])

    def inputs(self) -> Doubles:
        """Return the points that training sees, (N, 3)."""
        return self._training.points

    def distance(self, points: Doubles) -> Doubles:
        return in_cell_order(self._distance, points)

    def _distance(self, points: Doubles) -> Doubles:
        planes, nearest = self._near.distance(points)
        winding = igl.fast_winding_number(*self._winding, points)
        nearest[np.abs(winding - 0.5) < OPEN] = np.nan
        return np.where(np.isnan(planes), np.where(winding > 0.5, -nearest, nearest), planes)

    def _evened(self, spacings: Doubles) -> Doubles:
        """Limit each point's spacing (N,) by its neighbors' spacings."""
        index = self._tree.query(self._tree.data, k=min(EVEN_NEIGHBORS, len(spacings)), workers=-1)[1]
        return np.minimum(spacings, EVEN * np.median(spacings[index], axis=1))

    def _merged(self, surface: SurfacePoints) -> SurfacePoints:
        """Merge duplicates, with a warning. Raises UserError if too few points are left."""
        result = merge(surface)
        if result.merged:
            self.warnings.append(f"{self.name}: merged {result.merged:,} points with others at the same place")
        if result.dropped:
            self.warnings.append(f"{self.name}: left out {result.dropped:,} places where the normals cancel")
        check_count(len(result.surface.points), "points at different places")
        return result.surface


def _areas(tree: cKDTree) -> Doubles:
    """Estimate the surface area (N,) of a tree's points: the disc to the k-th neighbor contains k + 1/2 points."""
    distances = np.asarray(tree.query(tree.data, k=range(2, NEIGHBORS + 2), workers=-1)[0])
    return np.asarray(np.pi * (distances**2).sum(axis=1) / (np.arange(1, NEIGHBORS + 1) + 0.5).sum())
