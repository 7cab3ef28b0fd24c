"""An oriented point cloud as a shape to train on, which is the paper's input."""

from typing import Any

import igl
import numpy as np
from scipy.spatial import cKDTree

from ...model.errors import UserError
from .checks import FEWEST
from .cleaning import clean, pick
from .duplicates import merge
from .planes import LocalPlanes, NearestPoint
from .shape import Doubles, SurfacePoints, asked_together, unit

HELD_OUT = 0.05
"""Share of the points kept for evaluation."""
NEIGHBOURS = 12
"""Nearest neighbours that the area of a point is measured with."""
COARSE = 1e-4
"""Points nearer to one another than this, as a share of the shape's size, are one to the winding number.

Each halving of a distance adds a level to its octree: a million points in close pairs would fill 25 GB.
"""
NOISY_TRUSTED = 3.0
"""As planes.TRUSTED, of a cloud that was noisy, and has no planes: less is known close to its points."""
EVEN, EVEN_NEIGHBOURS = 1.5, 64
"""Most that a point's spacing counts, in the median one of so many neighbours, where the cloud was noisy.

A stray is far from all others: nothing would be known in many times that distance around it.
"""
OPEN = 0.3
"""Where the winding number is this close to 1/2, the cloud has a hole, which says nothing of the distance there."""


class CloudShape:
    """A `Shape` of points with outward normals, normalised.

    The distance is by the planes through the nearest points where these agree (`LocalPlanes`), and farther away that
    to the nearest point, as in the paper, with the sign of the cloud's winding number (Barill et al. 2018).
    """

    cloud = True
    moving = False

    def __init__(
        self,
        points: Doubles,
        normals: Doubles,
        colours: Doubles | None,
        name: str,
        source: dict[str, Any],
        noise: float | None = None,
    ) -> None:
        """points, normals: (N, 3), input space; normals of any length. colours: (N, 3) sRGB in [0, 1], or None.

        noise: standard deviation of the points, as a share of the shape's radius; None: measured (`cleaning.clean`).
        They are what `check_cloud` accepts. Raises UserError where too few points are at different places,
        or are left without the noise.
        """
        self.name, self.coloured = name, colours is not None
        self.warnings: list[str] = []
        merged = self._merged(SurfacePoints(points, unit(normals), colours))
        try:
            cloud = clean(merged.points, merged.normals, merged.colours, HELD_OUT, noise)
        except UserError as error:
            raise UserError(f"{name}: {error}") from None
        self.centre, self.scale, self.noise = cloud.centre, cloud.scale, cloud.noise
        self._held_out, self._kept = cloud.held_out, cloud.kept
        self.source = source | ({"noise": cloud.record} if cloud.record else {})
        # So cut, a tree finds the nearest of points on a surface from far away some ten times as fast.
        self._tree = cKDTree(self._kept.points, balanced_tree=False, compact_nodes=False)
        spacings = np.sqrt(_areas(self._tree))
        self._near: LocalPlanes | NearestPoint
        if self.noise:
            self._near = NearestPoint(self._tree, self._evened(spacings), NOISY_TRUSTED)
        else:
            self._near = LocalPlanes(self._tree, self._kept.normals, spacings)
        coarse = merge(self._kept, COARSE).surface
        indices, children, _, _ = igl.octree(coarse.points)
        weighted = coarse.points, coarse.normals, _areas(cKDTree(coarse.points)), indices, children
        self._winding = (*weighted, *igl.fast_winding_number_precompute(*weighted))

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
        return pick(cloud, index)

    def inputs(self) -> Doubles:
        """Return the points that training sees: (N, 3)."""
        return self._kept.points

    def distance(self, points: Doubles) -> Doubles:
        """Compute the signed distance, NaN where it is not known. Returns (N,)."""
        return asked_together(self._distance, points)

    def _distance(self, points: Doubles) -> Doubles:
        planes, nearest = self._near.distance(points)
        winding = igl.fast_winding_number(*self._winding, points)
        nearest[np.abs(winding - 0.5) < OPEN] = np.nan
        return np.where(np.isnan(planes), np.where(winding > 0.5, -nearest, nearest), planes)

    def _evened(self, spacings: Doubles) -> Doubles:
        """Hold each point's spacing to what its neighbours have. Takes and returns (N,)."""
        index = self._tree.query(self._tree.data, k=min(EVEN_NEIGHBOURS, len(spacings)), workers=-1)[1]
        return np.minimum(spacings, EVEN * np.median(spacings[index], axis=1))

    def _merged(self, surface: SurfacePoints) -> SurfacePoints:
        """Merge the points at one place, with a warning. Raises UserError where too few are left."""
        result = merge(surface)
        if result.merged:
            self.warnings.append(f"{self.name}: {result.merged:,} points are where others are; merged with them")
        if result.dropped:
            self.warnings.append(f"{self.name}: the normals cancel at {result.dropped:,} places; these are left out")
        count = len(result.surface.points)
        if count < FEWEST:
            raise UserError(f"{self.name}: {count} points at different places; a cloud needs at least {FEWEST}")
        return result.surface


def _areas(tree: cKDTree) -> Doubles:
    """Estimate the area of the surface that each of a tree's points stands for, by its neighbours. Returns (N,).

    The disc through the k-th neighbour holds k + 1/2 points.
    """
    distances = np.asarray(tree.query(tree.data, k=range(2, NEIGHBOURS + 2), workers=-1)[0])
    return np.asarray(np.pi * (distances**2).sum(axis=1) / (np.arange(1, NEIGHBOURS + 1) + 0.5).sum())
