"""Turns the normals of a cloud outward, part by part, as those of a mesh (parts.py)."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .parts import FLATTEST, OPENEST
from .shape import Doubles, unit

NEIGHBORS = 12  # nearest neighbors that belong to a point's part
WITNESSES = 8  # points of a part that say whether it lies inside the others
FAR = 8.0  # a neighbor farther than this multiple of the median distance is none
LEAST = 0.02  # parts with a smaller share of the area stay as they are


def turned_outward(points: Doubles, normals: Doubles) -> tuple[Doubles, int, int]:
    """Return the normals (N, 3), the number of parts that were turned, and the number of parts.

    A part that lies inside others and points inward is a cavity, and stays; so does an open part without a clear
    volume, such as a view from one side. points, normals: (N, 3).
    """
    directions = unit(normals)
    count = min(NEIGHBORS, len(points) - 1)
    distance, near = (np.asarray(found) for found in cKDTree(points).query(points, k=count + 1, workers=-1))
    areas = np.pi * distance[:, -1] ** 2 / (count + 0.5)
    areas = np.minimum(areas, 9 * np.median(areas))  # a stray point has no large surface
    step = distance[:, 1:]
    linked = step <= FAR * max(float(np.median(step)), 1e-300)
    one = np.repeat(np.arange(len(points)), count)[linked.ravel()]
    other = near[:, 1:].ravel()[linked.ravel()]
    links = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(len(points), len(points)))
    parts, part = connected_components(links, directed=False)

    def sums(rows: Doubles) -> Doubles:
        return np.bincount(part, rows, parts).astype(np.float64)

    area = sums(areas)
    large = area >= LEAST * area.sum()
    centers = np.stack([sums(areas * column) for column in points.T], axis=1) / np.maximum(area, 1e-300)[:, None]
    across = np.stack([sums(areas * column) for column in directions.T], axis=1)
    volumes = sums(areas * np.einsum("ij,ij->i", points - centers[part], directions) / 3)
    openness = np.linalg.norm(across, axis=1) / np.maximum(area, 1e-300)
    clear = large & (openness < OPENEST) & (np.abs(volumes) > FLATTEST * area**1.5)
    flips = clear & bool(volumes[clear].sum() < 0)
    senses = np.sign(volumes) * np.where(flips, -1, 1)
    outward = clear & (senses > 0)
    for inward in np.flatnonzero(clear & (senses < 0)):
        mine = np.flatnonzero(part == inward)
        asked = points[mine[np.linspace(0, len(mine) - 1, WITNESSES).astype(np.int64)]]
        solid = outward[part]
        signs = np.where(flips[part[solid]], -1.0, 1.0)
        winding = _winding(points[solid], directions[solid] * (signs * areas[solid])[:, None], asked)
        if np.mean(winding > 0.5) <= 0.5:
            flips[inward] ^= True
    turned = np.where(flips[part][:, None], -normals, normals)
    return turned, int(np.count_nonzero(flips)), int(np.count_nonzero(large))


def _winding(points: Doubles, vectors: Doubles, asked: Doubles) -> Doubles:
    """Return the winding number (M,) at places (M, 3) of small discs at points (N, 3) with area vectors (N, 3)."""
    found = np.empty(len(asked))
    for k, place in enumerate(asked):
        offset = points - place
        cubed = np.maximum(np.einsum("ij,ij->i", offset, offset), 1e-300) ** 1.5
        found[k] = np.einsum("ij,ij->i", offset, vectors) @ (1 / cubed) / (4 * np.pi)
    return found
