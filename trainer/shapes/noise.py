"""Measures the noise of an oriented point cloud, and moves its points back to the surface.

Both rest on one fact: for two points x_j, x_k of a sphere (or plane) with normals n_j, n_k, the product
<(n_j + n_k) / 2, x_k - x_j> is zero. So a nonzero product is noise, and curvature hardly contributes.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles, SurfacePoints, unit

SAMPLE = 3000  # number of points at which the noise is measured
FEWEST_NEIGHBORS, MOST_NEIGHBORS = 8, 512
"""Bounds of the number of neighbors of each; it grows until the farthest one is REACH standard deviations away."""
REACH = 4.0
MEDIAN = 0.6745  # median of |x| for a standard normal variable x
AGREE = 0.5  # least cosine of the normals of two points on one side of a thin part
EXACT = 0.2  # noise below this share of the points' spacing is indistinguishable from curvature
WIDTH = 0.5
"""Standard deviation of the first pass's weights, model units, if noise times spacing is one.

The variance of a mean falls with the square of the width, and its bias grows with it: the best width grows with the
cube root of noise times spacing. The second pass is half as wide, but not narrower than the noise.
"""
SPACINGS = 1.5  # smallest width of both passes, in spacings of the points
ROUGH_NEIGHBORS, WIDE_NEIGHBORS, NARROW_NEIGHBORS = 32, 64, 48
"""Neighbors that move a point: at the start of the first pass, in its second half, and in the second pass."""
CREASE = 0.5  # length of the difference of two normals that reduces a neighbor's weight by exp(-1/2)
CHUNK = 8192  # points per block, which bounds the memory
SUPPORT, LEAST_WEIGHT, FARTHEST = 0.15, 1.5, 5.0
"""A moved point is discarded if the sum of its neighbors' weights is below this share of the median or below this
number (an isolated point weighs 1), or if it moved by more than this many standard deviations."""


def measured(points: Doubles, normals: Doubles) -> float:
    """Measure the standard deviation of the points' noise, in their own unit; 0 if it is too small to detect.

    points, normals: (N, 3). The result is up to a tenth too small if the noise is as large as the shape's parts.
    """
    chosen = np.random.default_rng(0).permutation(len(points))[:SAMPLE]
    tree, count, most = cKDTree(points), FEWEST_NEIGHBORS, min(MOST_NEIGHBORS, len(points) - 1)
    while True:
        count = min(count, most)
        distance, index = (np.asarray(part) for part in tree.query(points[chosen], k=count + 1, workers=-1))
        mean = (normals[index] + normals[chosen, None]) / 2
        off = np.abs(np.einsum("ijk,ijk->ij", mean, points[index] - points[chosen, None]))[:, 1:]
        agree = (np.einsum("ijk,ik->ij", normals[index], normals[chosen]) > AGREE)[:, 1:]
        if not agree.any():
            return 0.0
        noise = float(np.median(off[agree])) / (MEDIAN * 2**0.5)
        reach = float(np.median(distance[:, -1]))
        if noise < EXACT * reach / count**0.5:
            return 0.0
        if reach >= REACH * noise or count == most:
            return noise
        count *= 2


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Points of a noisy cloud, moved to the surface."""

    surface: SurfacePoints
    """With the original normals: mean normals would erase detail smaller than the noise."""
    supported: NDArray[np.bool_]
    """(N,), true where enough neighbors agree with the point."""


def smoothed(cloud: SurfacePoints, others: SurfacePoints, noise: float) -> tuple[Smoothed, Smoothed]:
    """Move the points of a cloud, and then held-out points that the cloud does not see, to the cloud's surface.

    cloud, others: in model space. noise: standard deviation of the points, model units. The first pass moves a point
    to the surface of its noisy neighbors, the second to that of its neighbors after the first pass.
    """
    spacing = _spacing(cloud.points)
    wide = max(WIDTH * (noise * spacing) ** (1 / 3), SPACINGS * spacing)
    narrow = max(noise, wide / 2, SPACINGS * spacing)
    rough, fine = _Surface(cloud, wide, ROUGH_NEIGHBORS), _Surface(cloud, wide, WIDE_NEIGHBORS)

    def first(points: SurfacePoints) -> tuple[SurfacePoints, Doubles]:
        return fine.pull(rough.pull(points, 2)[0], 2)

    start, weight = first(cloud)
    again, least = _Surface(start, narrow, NARROW_NEIGHBORS), max(LEAST_WEIGHT, SUPPORT * float(np.median(weight)))

    def second(own: SurfacePoints, points: SurfacePoints, weight: Doubles) -> Smoothed:
        moved = again.pull(points, 1)[0].points
        near = np.linalg.norm(moved - own.points, axis=1) < FARTHEST * noise
        return Smoothed(replace(own, points=moved), near & (weight > least))

    return second(cloud, start, weight), second(others, *first(others))


class _Surface:
    """The surface of a cloud, the zero set of f(q) = sum_j w_j <(n_j + n) / 2, q - x_j> / sum_j w_j.

    A simpler form of an algebraic point set surface (Guennebaud and Gross 2007), exact on spheres. n is the mean normal
    around q; w_j falls with the distance of x_j from q and with the angle between n_j and n.
    """

    def __init__(self, cloud: SurfacePoints, width: float, neighbors: int) -> None:
        """width: standard deviation of the weights. neighbors: within 2 width, after the cloud is thinned."""
        tree = cKDTree(cloud.points)
        probe = cloud.points[:: max(1, len(cloud.points) // SAMPLE)]
        within = float(np.median(tree.query_ball_point(probe, 2 * width, return_length=True, workers=-1)))
        stride = max(1, round(within / neighbors))
        order = np.random.default_rng(0).permutation(len(cloud.points))[::stride]
        self._points = cloud.points[order].astype(np.float32)
        self._normals = cloud.normals[order].astype(np.float32)
        self._tree, self._width, self._count = cKDTree(cloud.points[order]), width, min(neighbors, len(order))

    def pull(self, surface: SurfacePoints, rounds: int) -> tuple[SurfacePoints, Doubles]:
        """Move points to the surface. Returns them with the mean normals there, and the sums of weights (N,)."""
        parts = [
            self._pull(surface.points[start : start + CHUNK], surface.normals[start : start + CHUNK], rounds)
            for start in range(0, len(surface.points), CHUNK)
        ]
        points, normals, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
        return replace(surface, points=points, normals=unit(normals)), weight

    def _pull(self, points: Doubles, normals: Doubles, rounds: int) -> tuple[Doubles, Doubles, Doubles]:
        index = self._tree.query(points, k=self._count, workers=-1)[1]
        neighbors, their_normals = self._points[index], self._normals[index]
        q, n = points.astype(np.float32), normals.astype(np.float32)
        for _ in range(rounds):
            away = q[:, None] - neighbors
            tilt = their_normals - n[:, None]
            exponent = np.einsum("ijk,ijk->ij", away, away) / self._width**2
            exponent += np.einsum("ijk,ijk->ij", tilt, tilt) / CREASE**2
            weight = np.exp(-exponent / 2)
            total = np.maximum(weight.sum(axis=1), 1e-30)
            mean = np.einsum("ij,ijk->ik", weight, their_normals)
            along = np.einsum("ijk,ijk->ij", away, their_normals) + np.einsum("ijk,ik->ij", away, n)
            f = (weight * along).sum(axis=1) / (2 * total)
            n = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-30)
            q = q - f[:, None] * n
        return q.astype(np.float64), n.astype(np.float64), total.astype(np.float64)


def _spacing(points: Doubles) -> float:
    """Measure the median spacing of points: the distance to the k-th neighbor over the square root of k."""
    probe = points[:: max(1, len(points) // SAMPLE)]
    count = min(FEWEST_NEIGHBORS, len(points) - 1)
    reach = float(np.median(cKDTree(points).query(probe, k=[count + 1])[0]))
    return reach / math.sqrt(count)
