"""Turns a depth map into an oriented point cloud (Appendix G.1)."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..model.errors import UserError
from .backside import Mask, backside, rim
from .cloud import Cloud, Cut, Doubles
from .depth_map import step_of
from .intrinsics import Intrinsics
from .planes import Planes, fit_planes

GRAZING = 0.17  # A pixel is dropped if the cosine between its normal and its ray is smaller: 80 degrees
SUPPORT = 0.45  # A pixel is dropped if a smaller share of its window lies on its plane: it is between two surfaces
OFF = 4.0  # A pixel is dropped if it is off its plane by more standard deviations of the noise, and CURVED
CURVED = 0.002  # relative distance from its plane that the curvature of a surface may cause
NOISIEST = 0.1  # A map with a larger relative noise is refused
ISLAND = 0.002  # A connected component with a smaller share of all pixels is dropped
MOST = 300_000  # most points of a cloud; larger maps use every second or third pixel of a row and column
FEWEST = 3  # fewest rows, and columns, of pixels with a depth: noise is measured by second differences
FLIP = np.array([1.0, -1.0, -1.0])  # from a picture's axes (y down, z away) to a cloud's


def unproject(
    depth: Doubles,
    camera: Intrinsics,
    colors: NDArray[np.uint8] | None,
    step: Doubles | float = 0.0,
    *,
    close: bool = False,
) -> tuple[Cloud, Cut, Planes]:
    """Turn a depth map into a cloud.

    depth: (H, W), along the axis, NaN where missing. colors: (H, W, 3), sRGB. step: rounding step of the depths,
    relative. close: add a plausible back side (`backside`). Returns the cloud, the numbers of dropped pixels, and the
    fitted planes. Raises UserError if no point is left.
    """
    rows, columns = (slice(*_extent((~np.isnan(depth)).sum(axis=axis))) for axis in (1, 0))
    x, y = camera.plane(*depth.shape)
    x, y, depth = x[columns], y[rows], depth[rows, columns]
    if isinstance(step, np.ndarray):
        step = step[rows, columns]
    if min(depth.shape) < FEWEST:
        raise UserError(f"only {depth.shape[1]} x {depth.shape[0]} pixels have a depth; a surface is larger")
    planes = fit_planes(depth, x, y, step)
    if planes.noise > NOISIEST:
        raise UserError(f"its depths jump by {planes.noise:.0%} from pixel to pixel: is it a depth map?")
    kept, cut = _kept(depth, planes)
    if not kept.any():
        raise UserError("all pixels are depth edges or grazing: is it a depth map, and is --fov right?")
    rays = np.stack(np.broadcast_arrays(x, y[:, None], 1.0), axis=-1)
    sides = [(planes.depth, planes.normals)]
    if close:
        sides.append(backside(np.where(kept, planes.depth, np.nan), x, y))
    stride = int(np.ceil(np.sqrt(len(sides) * kept.sum() / MOST)))
    chosen = kept & (np.arange(len(y))[:, None] % stride == 0) & (np.arange(len(x)) % stride == 0)
    parts = []
    for found, normals in sides:
        here = chosen & ~np.isnan(found) & ~np.isnan(normals).any(axis=-1)
        parts.append((rays[here] * found[here][:, None], normals[here], np.nonzero(here)))
    if close:
        parts.append(rim(np.where(kept, planes.depth, np.nan), sides[1][0], ~np.isnan(depth), x, y))
    painted = None
    if colors is not None:
        painted = np.concatenate([colors[rows, columns][here] for _, _, here in parts])
    points, normals = (np.concatenate([part[k] for part in parts]) * FLIP for k in (0, 1))
    return Cloud(points, normals, painted), cut, planes


def _extent(counts: NDArray[np.int64]) -> tuple[int, int]:
    """Return the range of indices with nonzero counts."""
    found = np.flatnonzero(counts)
    return int(found[0]), int(found[-1]) + 1


def _kept(depth: Doubles, planes: Planes) -> tuple[Mask, Cut]:
    """Choose the pixels (H, W) that become points."""
    valid = ~np.isnan(depth)
    with np.errstate(invalid="ignore"):
        grazing = valid & ~(planes.facing >= GRAZING)
        edges = valid & ~grazing & ~(planes.support >= SUPPORT)
        off = valid & ~grazing & ~edges & ~(planes.residual <= OFF * planes.noise + CURVED)
    kept = valid & ~grazing & ~edges & ~off
    labels, count = ndimage.label(kept)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    small = sizes < ISLAND * kept.sum()
    small[0] = False
    kept &= ~small[labels]
    return kept, Cut(int(grazing.sum()), int(edges.sum()), int(off.sum() + small[labels].sum()))


def step_share(values: Doubles, depth: Doubles, inverse: bool) -> Doubles | float:
    """Return the relative rounding step (H, W) of each depth, or 0 if the file has many different values.

    values: (H, W), of the file. depth: (H, W), converted from `values`. inverse: whether values are relative inverse
    depths.
    """
    step = step_of(values)
    if not step:
        return 0.0
    if inverse:
        lowest, highest = np.nanmin(values), np.nanmax(values)
        slope = (1 / np.nanmin(depth) - 1 / np.nanmax(depth)) / (highest - lowest)
        return np.asarray(step * slope * depth)
    return np.asarray(step * np.nanmedian(depth) / np.nanmedian(values) / depth)
