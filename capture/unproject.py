"""A depth map becomes an oriented point cloud (Appendix G.1): what one picture shows, as a shape to train on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..model.errors import UserError
from .backside import backside, rim
from .depth_map import Doubles, step_of
from .intrinsics import Intrinsics
from .planes import Planes, fit_planes

Mask = NDArray[np.bool_]

GRAZING = 0.17
"""Cosine of the angle to the ray below which a surface is seen too flatly to tell where it is: 80 degrees."""
ALONE = 0.45
"""A pixel is dropped where a smaller share of its window lies on its plane: between two surfaces, or off all."""
OFF = 4.0
"""It is dropped, too, where it is off its plane by more standard deviations of the noise."""
CURVED = 0.002
"""What a curved surface may be off its plane besides, as a share of the depth."""
NOISIEST = 0.1
"""A map with more noise, as a share of its depths, is none."""
ISLAND = 0.002
"""A piece of surface with a smaller share of all pixels is dropped."""
MOST = 300_000
"""Points that a cloud has at most; a larger depth map gives every second pixel, or every third, of a row and column."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """An oriented point cloud. The camera is at the origin and looks along -z, y points up."""

    points: Doubles
    """(N, 3), in the unit of the depths."""
    normals: Doubles
    """(N, 3), of length 1, outward."""
    colours: NDArray[np.uint8] | None
    """(N, 3), sRGB; None without a picture."""


@dataclass(frozen=True)
class Cut:
    """How many pixels with a depth give no point, and why."""

    grazing: int
    """Seen too flatly."""
    edges: int
    """At a depth edge: too few of their neighbours are of one surface with them."""
    outliers: int
    """Off the surface of their neighbours, or in small pieces."""


def unproject(
    depth: Doubles,
    camera: Intrinsics,
    colours: NDArray[np.uint8] | None,
    step: Doubles | float = 0.0,
    *,
    close: bool = False,
) -> tuple[Cloud, Cut, Planes]:
    """Turn a depth map into a cloud.

    depth: (H, W), along the axis, NaN where there is nothing. colours: (H, W, 3), sRGB. step: to which the depths are
    rounded, as a share of them. close: add points of a plausible unseen side (`backside`).
    Returns the cloud, what was cut, and the planes that were fitted. Raises UserError where nothing is left.
    """
    rows, columns = (slice(*_extent((~np.isnan(depth)).sum(axis=axis))) for axis in (1, 0))
    x, y = camera.plane(*depth.shape)
    x, y, depth = x[columns], y[rows], depth[rows, columns]
    if isinstance(step, np.ndarray):
        step = step[rows, columns]
    planes = fit_planes(depth, x, y, step)
    if planes.noise > NOISIEST:
        raise UserError(f"its depths jump by {planes.noise:.0%} from pixel to pixel: is it a depth map?")
    kept, cut = _kept(depth, planes)
    if not kept.any():
        raise UserError("no surface is left without depth edges and grazing pixels: is it a depth map, seen by --fov?")
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
    if colours is not None:
        painted = np.concatenate([colours[rows, columns][here] for _, _, here in parts])
    points, normals = (np.concatenate([part[k] for part in parts]) * FLIP for k in (0, 1))
    return Cloud(points, normals, painted), cut, planes


FLIP = np.array([1.0, -1.0, -1.0])
"""From pictures' axes (y down, z away) to those of a cloud."""


def _extent(counts: NDArray[np.int64]) -> tuple[int, int]:
    """Return the first index whose count is not zero, and the one after the last."""
    found = np.flatnonzero(counts)
    return int(found[0]), int(found[-1]) + 1


def _kept(depth: Doubles, planes: Planes) -> tuple[Mask, Cut]:
    """Choose the pixels (H, W) that become points."""
    there = ~np.isnan(depth)
    with np.errstate(invalid="ignore"):
        flat = there & ~(planes.facing >= GRAZING)
        lonely = there & ~flat & ~(planes.support >= ALONE)
        off = there & ~flat & ~lonely & ~(planes.residual <= OFF * planes.noise + CURVED)
    kept = there & ~flat & ~lonely & ~off
    labels, count = ndimage.label(kept)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    small = sizes < ISLAND * kept.sum()
    small[0] = False
    kept &= ~small[labels]
    return kept, Cut(int(flat.sum()), int(lonely.sum()), int(off.sum() + small[labels].sum()))


def step_share(values: Doubles, depth: Doubles, inverse: bool) -> Doubles | float:
    """Return to what share of itself each depth is rounded: (H, W), or 0 where the file holds many different values.

    values: (H, W), of the file; inverse: whether they are relative inverse depths, so that depth is none of them.
    """
    step = step_of(values)
    if not step:
        return 0.0
    if inverse:
        lowest, highest = np.nanmin(values), np.nanmax(values)
        slope = (1 / np.nanmin(depth) - 1 / np.nanmax(depth)) / (highest - lowest)
        return np.asarray(step * slope * depth)
    return np.asarray(step * np.nanmedian(depth) / np.nanmedian(values) / depth)
