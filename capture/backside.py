"""A plausible unseen side: the seen one, mirrored behind the outline and smoothed."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from .depth_map import Doubles
from .planes import fit_planes

SIDE = 128
"""Pixels of the longer side of the grid that the outline's depths are continued on."""
SMOOTH = 0.03
"""Standard deviation of what smooths the unseen side, as a share of the longer side of the picture."""
THINNEST = 0.25
"""Where the seen surface lies behind the unseen one, as in a bowl: the thickness there, as a share of `_round`."""
OUTLINE = 1.5
"""Standard deviation of what smooths the outline for its normals, pixels."""
MOST_CUT = 4.0
"""Pixels between a point and the outline, at most, for the rim to be at the outline: farther in is a depth edge."""
THICKEST = 256
"""Points at most from the one side to the other."""


def backside(depth: Doubles, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
    """Invent what is behind a surface that is seen from one side.

    The outline's depths, continued inside by a harmonic function, cut the shape in two; the unseen part mirrors the
    seen one, smoothed, and meets it at the outline as a ball does.

    depth: (H, W), of the seen surface along the axis, NaN outside. x (W,), y (H,): where the pixels' rays meet the
    plane at distance 1. Returns the unseen surface's depths (H, W) and its normals (H, W, 3), away from the camera.
    """
    filled = ndimage.binary_fill_holes(~np.isnan(depth))
    cut = _cut(_extended(depth), filled)
    seen = ~np.isnan(depth)
    sigma = SMOOTH * max(depth.shape)
    weight = ndimage.gaussian_filter(seen.astype(np.float64), sigma)
    height = ndimage.gaussian_filter(np.where(seen, np.maximum(cut - depth, 0), 0.0), sigma) / np.maximum(weight, 1e-9)
    inward = ndimage.distance_transform_edt(np.pad(filled, 1))[1:-1, 1:-1] * abs(x[1] - x[0]) * cut
    round_ = _round(inward)
    behind = np.fmax(cut + np.minimum(height, round_), depth + THINNEST * round_)
    behind[~filled] = np.nan
    planes = fit_planes(behind, x, y)
    return planes.depth, -planes.normals


def rim(
    front: Doubles, behind: Doubles, seen: NDArray[np.bool_], x: Doubles, y: Doubles
) -> tuple[Doubles, Doubles, tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Join the seen surface to the unseen one along the outline, where both would go on beyond it otherwise.

    front, behind: depths (H, W) of both, NaN where there is none. seen: (H, W), where the picture has the shape; pixels
    along its outline that were cut lie within the rim. x (W,), y (H,): where the pixels' rays meet the plane at
    distance 1. Returns points (N, 3) from the one to the other, a pixel apart, their normals, which are those of the
    outline, and the rows and columns (N,) of their pixels.
    """
    filled = ndimage.binary_fill_holes(~np.isnan(front))
    smooth = ndimage.gaussian_filter(filled.astype(np.float64), OUTLINE)
    right, down = -np.gradient(smooth, axis=1), -np.gradient(smooth, axis=0)
    there = filled & ~ndimage.binary_erosion(filled) & (front < behind) & (np.hypot(down, right) > 0)
    rows, columns = np.nonzero(there)
    near, far = front[there], behind[there]
    outward = np.stack([right[there] * np.sign(x[1] - x[0]), down[there] * np.sign(y[1] - y[0])], axis=1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    pitch = abs(x[1] - x[0])
    rays = np.column_stack((x[columns], y[rows], np.ones(len(rows))))
    cut = ndimage.distance_transform_edt(np.pad(seen, 1))[1:-1, 1:-1][there] - 1
    rays[:, :2] += pitch * (0.5 + np.where(cut <= MOST_CUT, cut, 0))[:, None] * outward
    count = np.clip(np.ceil((far - near) / (pitch * near)), 1, THICKEST).astype(np.int64)
    pixel = np.repeat(np.arange(len(rows)), count)
    place = (np.arange(len(pixel)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[pixel]
    depth = near[pixel] + place * (far - near)[pixel]
    normals = np.column_stack((outward, -(outward * rays[:, :2]).sum(axis=1)))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return rays[pixel] * depth[:, None], normals[pixel], (rows[pixel], columns[pixel])


def _round(inward: Doubles) -> Doubles:
    """Return the height of the largest ball inside the outline at a distance from the outline, in the same unit."""
    radius = inward.max()
    return np.asarray(np.sqrt(np.maximum(inward * (2 * radius - inward), 0)))


def _extended(depth: Doubles) -> Doubles:
    """Give each pixel without a depth that of the nearest one with a depth."""
    nearest = ndimage.distance_transform_edt(np.isnan(depth), return_distances=False, return_indices=True)
    return np.asarray(depth[tuple(nearest)])


def _cut(depth: Doubles, filled: NDArray[np.bool_]) -> Doubles:
    """Continue the depths of an outline inside it by a harmonic function, on a coarse grid. Returns (H, W)."""
    stride = max(1, round(max(depth.shape) / SIDE))
    coarse, values = filled[::stride, ::stride], depth[::stride, ::stride]
    inner = ndimage.binary_erosion(coarse)
    index = np.full(coarse.shape, -1)
    index[inner] = np.arange(inner.sum())
    rows, columns = np.nonzero(inner)
    right = np.zeros(len(rows))
    entries = [(np.arange(len(rows)), np.arange(len(rows)), np.full(len(rows), 4.0))]
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        beside = index[rows + dy, columns + dx]
        known = beside < 0
        right[known] += values[rows + dy, columns + dx][known]
        entries.append((np.flatnonzero(~known), beside[~known], np.full((~known).sum(), -1.0)))
    row, column, value = (np.concatenate(part) for part in zip(*entries, strict=True))
    solved = values.copy()
    if len(rows):
        solved[inner] = spsolve(sparse.csc_matrix((value, (row, column)), shape=(len(rows),) * 2), right)
    solved[~coarse] = np.nan
    at = np.indices(depth.shape) / stride
    return np.asarray(ndimage.map_coordinates(_extended(solved), at, order=1, mode="nearest"))
