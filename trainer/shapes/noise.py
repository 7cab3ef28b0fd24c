"""The noise of an oriented point cloud: how large it is, and the points moved back to the surface.

Both rest on one fact: for two points x_j, x_k of a sphere (or plane) with their normals n_j, n_k, the product
<(n_j + n_k) / 2, x_k - x_j> is zero. What it is instead is noise, and curvature hardly counts.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .shape import Doubles, SurfacePoints, unit

SAMPLE = 3000
"""Points that the noise is measured at."""
FEWEST_NEIGHBOURS, MOST_NEIGHBOURS = 8, 512
"""Neighbours that a point is compared with: more of them where they are as close as the noise is large."""
REACH = 4.0
"""Distance of the farthest neighbours that is far enough, in standard deviations of the noise."""
MEDIAN = 0.6745
"""Median of the size of a standard normal variable."""
AGREE = 0.5
"""Least cosine of the normals of two points of one side of a thin part."""
EXACT = 0.2
"""Noise below this share of the points' spacing does not differ from the curvature of an exact cloud."""
WIDTH = 0.5
"""Standard deviation of the first pass's weights, model units, for noise times spacing of one.

The variance of a mean falls with the square of that width, and its bias grows with it: the best goes with the cube root
of noise times spacing. The second pass, over smoothed points, is half as wide, but not narrower than the noise.
"""
SPACINGS = 1.5
"""The least that the widths are, in spacings of the points."""
ROUGH_NEIGHBOURS, WIDE_NEIGHBOURS, NARROW_NEIGHBOURS = 32, 64, 48
"""Neighbours that a point is moved by: in the first pass, from afar and then from nearby; in the second pass."""
CREASE = 0.5
"""Difference of two normals, as a length, that makes a neighbour's weight smaller by exp(-1/2)."""
CHUNK = 8192
"""Points that are moved at once."""
SUPPORT = 0.15
"""A point where the neighbours weigh less than this share of the usual is none of the surface's."""
ALONE = 1.5
"""Nor is one where they weigh less than this: a point by itself weighs 1."""
FARTHEST = 5.0
"""Nor is one that was farther away from it than so many standard deviations."""


def measured(points: Doubles, normals: Doubles) -> float:
    """Measure the standard deviation of the points' noise, in their own unit; 0 where it does not show.

    points, normals: (N, 3). It comes out up to a tenth too small where the noise is as large as the shape's parts.
    """
    chosen = np.random.default_rng(0).permutation(len(points))[:SAMPLE]
    tree, count, most = cKDTree(points), FEWEST_NEIGHBOURS, min(MOST_NEIGHBOURS, len(points) - 1)
    while True:
        count = min(count, most)
        distance, index = (np.asarray(part) for part in tree.query(points[chosen], k=count + 1, workers=-1))
        between = (normals[index] + normals[chosen, None]) / 2
        off = np.abs(np.einsum("ijk,ijk->ij", between, points[index] - points[chosen, None]))[:, 1:]
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
    """Points moved to the surface that a noisy cloud stands for."""

    surface: SurfacePoints
    """With the normals that they had: means of normals would wash out detail that is smaller than the noise."""
    supported: NDArray[np.bool_]
    """Which of them have neighbours that agree with them: (N,)."""


def smoothed(cloud: SurfacePoints, others: SurfacePoints, noise: float) -> tuple[Smoothed, Smoothed]:
    """Move the points of a cloud to the surface that they stand for, and then others, which the cloud does not see.

    cloud, others: in model space. noise: standard deviation of the points, model units. In the first pass a point is
    moved to the surface of its noisy neighbours; in the second, to that of its neighbours as the first has moved them.
    """
    spacing = _spacing(cloud.points)
    wide = max(WIDTH * (noise * spacing) ** (1 / 3), SPACINGS * spacing)
    narrow = max(noise, wide / 2, SPACINGS * spacing)
    rough, fine = _Surface(cloud, wide, ROUGH_NEIGHBOURS), _Surface(cloud, wide, WIDE_NEIGHBOURS)

    def first(points: SurfacePoints) -> tuple[SurfacePoints, Doubles]:
        return fine.pull(rough.pull(points, 2)[0], 2)

    start, weight = first(cloud)
    again, least = _Surface(start, narrow, NARROW_NEIGHBOURS), max(ALONE, SUPPORT * float(np.median(weight)))

    def second(own: SurfacePoints, points: SurfacePoints, weight: Doubles) -> Smoothed:
        moved = again.pull(points, 1)[0].points
        near = np.linalg.norm(moved - own.points, axis=1) < FARTHEST * noise
        return Smoothed(replace(own, points=moved), near & (weight > least))

    return second(cloud, start, weight), second(others, *first(others))


class _Surface:
    """The surface of a cloud, the zero set of f(q) = sum_j w_j <(n_j + n) / 2, q - x_j> / sum_j w_j.

    It is an algebraic point set surface (Guennebaud and Gross 2007) in a simpler form: exact on spheres. n is the mean
    normal around q, and w_j falls with the distance of x_j from q and with the angle of n_j and n.
    """

    def __init__(self, cloud: SurfacePoints, width: float, neighbours: int) -> None:
        """width: standard deviation of the weights. neighbours: that are looked at; of the cloud thinned to fit."""
        tree = cKDTree(cloud.points)
        probe = cloud.points[:: max(1, len(cloud.points) // SAMPLE)]
        within = float(np.median(tree.query_ball_point(probe, 2 * width, return_length=True, workers=-1)))
        thinned = max(1, round(within / neighbours))
        order = np.random.default_rng(0).permutation(len(cloud.points))[::thinned]
        self._points = cloud.points[order].astype(np.float32)
        self._normals = cloud.normals[order].astype(np.float32)
        self._tree, self._width, self._count = cKDTree(cloud.points[order]), width, min(neighbours, len(order))

    def pull(self, surface: SurfacePoints, rounds: int) -> tuple[SurfacePoints, Doubles]:
        """Move points to the surface. Returns them with the mean normals there, and the sums of their weights (N,)."""
        parts = [
            self._pull(surface.points[start : start + CHUNK], surface.normals[start : start + CHUNK], rounds)
            for start in range(0, len(surface.points), CHUNK)
        ]
        points, normals, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
        return replace(surface, points=points, normals=unit(normals)), weight

    def _pull(self, points: Doubles, normals: Doubles, rounds: int) -> tuple[Doubles, Doubles, Doubles]:
        index = self._tree.query(points, k=self._count, workers=-1)[1]
        near, theirs = self._points[index], self._normals[index]
        q, n = points.astype(np.float32), normals.astype(np.float32)
        for _ in range(rounds):
            away = q[:, None] - near
            turned = theirs - n[:, None]
            apart = np.einsum("ijk,ijk->ij", away, away) / self._width**2
            apart += np.einsum("ijk,ijk->ij", turned, turned) / CREASE**2
            weight = np.exp(-apart / 2)
            total = np.maximum(weight.sum(axis=1), 1e-30)
            mean = np.einsum("ij,ijk->ik", weight, theirs)
            along = np.einsum("ijk,ijk->ij", away, theirs) + np.einsum("ijk,ik->ij", away, n)
            f = (weight * along).sum(axis=1) / (2 * total)
            n = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-30)
            q = q - f[:, None] * n
        return q.astype(np.float64), n.astype(np.float64), total.astype(np.float64)


def _spacing(points: Doubles) -> float:
    """Measure the median spacing of points: the distance to the k-th neighbour, over the root of k."""
    probe = points[:: max(1, len(points) // SAMPLE)]
    count = min(FEWEST_NEIGHBOURS, len(points) - 1)
    reach = float(np.median(cKDTree(points).query(probe, k=[count + 1])[0]))
    return reach / math.sqrt(count)
