"""How fine the colors of a shape are, and how many weights would hold them."""

import numpy as np
from scipy.spatial import cKDTree

from .shapes.shape import Doubles

POINTS, ASKED = 60_000, 3000  # samples in the tree, and those whose neighbors are compared
NEIGHBORS = 48
HALF = 0.5  # share of the colors' variance that two points differ by at the length of the detail
FLAT = 1e-4  # colors of a smaller variance have no detail
WEIGHTS = 2.0
"""Weights that a network needs for each square of the detail's length on the surface.

Measured on a ball with random waves: 13,900 weights at 0.042; 8,771 leave 7 % of the variance, 33,923 leave 0.2 %.
"""
ENOUGH = 1.25  # a network with a smaller share of the needed weights blurs visibly
WIDEST = 512


def detail(points: Doubles, colors: Doubles) -> tuple[float, float]:
    """Return the length of the finest detail of colors, in radii, and the area of the surface; infinite for none.

    points: (N, 3), evenly spread on a surface in model space. colors: (N, 3). The length is the distance at which two
    points differ by half of the variance of all (half the range of a variogram).
    """
    points, colors = points[:POINTS], colors[:POINTS]
    variance = float(colors.var(axis=0).sum())
    asked = np.random.default_rng(0).choice(len(points), min(ASKED, len(points)), replace=False)
    count = min(NEIGHBORS, len(points) - 1)
    distance, near = (np.asarray(found) for found in cKDTree(points).query(points[asked], k=count + 1, workers=-1))
    area = float(np.median(np.pi * distance[:, -1] ** 2 / count) * len(points))
    if variance < FLAT:
        return np.inf, area
    differ = ((colors[near[:, 1:]] - colors[asked, None]) ** 2).sum(axis=2) / 2
    # The k-th neighbors of all points are about equally far.
    rising, lengths = differ.mean(axis=0) / variance, distance[:, 1:].mean(axis=0)
    reached = np.flatnonzero(rising >= HALF)
    return (float(lengths[reached[0]]) if len(reached) else np.inf), area


def weights_of(network: tuple[int, int]) -> int:
    """Return the number of weights of a texture network (width, depth)."""
    width, depth = network
    return 4 * width + depth * (width * width + width) + 3 * width + 3


def detail_line(points: Doubles, colors: Doubles, network: tuple[int, int]) -> str:
    """Say that colors have more detail than a network (width, depth) holds, and how many weights would; "" if not.

    points: (N, 3), evenly spread on a surface in model space. colors: (N, 3).
    """
    length, area = detail(points, colors)
    needed, there = WEIGHTS * area / length**2, weights_of(network)
    if needed <= ENOUGH * there:
        return ""
    said = f"colors have details of {length:.2g} radii, which {network[0]}x{network[1]} ({there:,} weights) blurs"
    width = next((w for w in range(16, WIDEST + 1, 16) if weights_of((w, 2)) >= needed), None)
    if width is None:
        return f"{said}; they need {needed:,.0f} weights, more than --texture-network {WIDEST}x2 has"
    return f"{said}; some {needed:,.0f} weights hold them: --texture-network {width}x2"
