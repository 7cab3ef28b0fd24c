"""Invents a plausible back side: the front, mirrored behind the outline and smoothed."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from .cloud import Doubles
from .planes import fit_planes

Mask = NDArray[np.bool_]

SIDE = 128  # longer side, pixels, of the grid on which the outline's depths are interpolated
SMOOTH = 0.03  # standard deviation of the filter that smooths the back side, as a share of the picture's longer side
THINNEST = 0.25  # thickness where the front lies behind the back, as in a bowl, as a share of `_round`
OUTLINE = 1.5  # standard deviation of the filter that smooths the outline for its normals, pixels
MOST_CUT = 4.0
"""Largest distance, pixels, of a point from the outline for the rim to reach the outline; depth edges are farther."""
THICKEST = 256  # most points from front to back at one pixel


def backside(depth: Doubles, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
    """Invent the back of a surface.

    The outline's depths, interpolated by a harmonic function, cut the shape in two; the back mirrors the front,
    smoothed, and meets it at the outline as a ball does.

    depth: (H, W), of the front along the axis, NaN outside. x (W,), y (H,): coordinates of the pixels' rays in the
    plane at distance 1. Returns the back's depths (H, W) and its normals (H, W, 3), away from the camera.
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
    front: Doubles, behind: Doubles, seen: Mask, x: Doubles, y: Doubles
) -> tuple[Doubles, Doubles, tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Join front and back along the outline; without the rim, both would continue beyond it.

    front, behind: depths (H, W), NaN where missing. seen: (H, W), the picture's pixels of the shape; the rim also
    covers pixels near the outline that were cut. x (W,), y (H,): coordinates of the pixels' rays in the plane at
    distance 1. Returns points (N, 3) from front to back, a pixel apart, the outline's normals (N, 3), and the rows and
    columns (N,) of the points' pixels.
    """
    filled = ndimage.binary_fill_holes(~np.isnan(front))
    smooth = ndimage.gaussian_filter(filled.astype(np.float64), OUTLINE)
    right, down = -np.gradient(smooth, axis=1), -np.gradient(smooth, axis=0)
    edge = filled & ~ndimage.binary_erosion(filled) & (front < behind) & (np.hypot(down, right) > 0)
    rows, columns = np.nonzero(edge)
    near, far = front[edge], behind[edge]
    outward = np.stack([right[edge] * np.sign(x[1] - x[0]), down[edge] * np.sign(y[1] - y[0])], axis=1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    pitch = abs(x[1] - x[0])
    rays = np.column_stack((x[columns], y[rows], np.ones(len(rows))))
    cut = ndimage.distance_transform_edt(np.pad(seen, 1))[1:-1, 1:-1][edge] - 1
    rays[:, :2] += pitch * (0.5 + np.where(cut <= MOST_CUT, cut, 0))[:, None] * outward
    count = np.clip(np.ceil((far - near) / (pitch * near)), 1, THICKEST).astype(np.int64)
    pixel = np.repeat(np.arange(len(rows)), count)
    place = (np.arange(len(pixel)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[pixel]
    depth = near[pixel] + place * (far - near)[pixel]
    normals = np.column_stack((outward, -(outward * rays[:, :2]).sum(axis=1)))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return rays[pixel] * depth[:, None], normals[pixel], (rows[pixel], columns[pixel])


def _round(inward: Doubles) -> Doubles:
    """Return the height of the largest ball inside the outline, at a distance `inward` from the outline."""
    radius = inward.max()
    return np.asarray(np.sqrt(np.maximum(inward * (2 * radius - inward), 0)))


def _extended(depth: Doubles) -> Doubles:
    """Copy the nearest depth to each pixel without one."""
    nearest = ndimage.distance_transform_edt(np.isnan(depth), return_distances=False, return_indices=True)
    return np.asarray(depth[tuple(nearest)])


def _cut(depth: Doubles, filled: Mask) -> Doubles:
    """Interpolate the depths of an outline inside it by a harmonic function, on a coarse grid. Returns (H, W)."""
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
