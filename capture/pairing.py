"""Checks that photographs and cameras belong together: the masks against the hull that all of them cut out."""

import numpy as np

from .cloud import Doubles
from .photographs import Photographs

POINTS = 200_000  # random points of the ball
SIDE = 48  # pixels along the longer side of a mask, for the comparison
AGREE = 0.95  # least share of the masks that the hull covers


def agreement(photographs: Photographs) -> float | None:
    """Return the share of the masks' pixels onto which their common hull projects; None without masks.

    Where the cameras belong to other photographs, the hull is too small, and the share is low.
    """
    views = photographs.views
    if not photographs.masked:
        return None
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(POINTS, 3))
    radii = rng.random((POINTS, 1)) ** (1 / 3)
    points: Doubles = directions / np.linalg.norm(directions, axis=1, keepdims=True) * radii
    inside = np.ones(POINTS, np.bool_)
    places, there_of = [], []
    for view in views:
        to_pixels = np.linalg.inv(view.rays)
        seen = (points - view.eye) @ to_pixels.T
        with np.errstate(all="ignore"):
            u, v = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2]
        width, height = view.size
        there = (seen[:, 2] > 0) & (u >= 0) & (u < width) & (v >= 0) & (v < height)
        column, row = (np.where(there, at, 0).astype(np.int64) for at in (u, v))
        assert view.mask is not None
        inside &= view.mask[row, column] | ~there  # what a view does not see, it does not cut
        there_of.append(there)
        places.append((row, column))
    covered = wanted = 0
    for view, (row, column), there in zip(views, places, there_of, strict=True):
        assert view.mask is not None
        step = max(1, -(-max(view.size) // SIDE))
        height, width = (side // step for side in view.mask.shape)
        mask = view.mask[: height * step, : width * step].reshape(height, step, width, step).mean(axis=(1, 3)) > 0.5
        hull = np.zeros((height + 1, width + 1), np.bool_)
        here = inside & there
        hull[np.minimum(row[here] // step, height), np.minimum(column[here] // step, width)] = True
        covered += int((hull[:height, :width] & mask).sum())
        wanted += int(mask.sum())
    return covered / wanted if wanted else None


def pairing_line(photographs: Photographs) -> tuple[str, str]:
    """Return a line about the photographs and how well they agree with their cameras, and a warning or ""."""
    views = photographs.views
    width, height = views[0].size
    away = float(np.median([np.linalg.norm(view.eye) for view in views]))
    line = (
        f"{photographs.name}: {len(views)} photographs of {width} x {height}, {photographs.up} up, cameras "
        f"{away:.2g} radii from the ball's center"
    )
    share = agreement(photographs)
    if share is None:
        return f"{line}; no masks, so that nothing tells whether photographs and cameras belong together", ""
    warning = ""
    if share < AGREE:
        warning = (
            f"the hull of all masks covers only {share:.0%} of them: are the photographs in the order of the cameras, "
            "and does the ball hold the object?"
        )
    return f"{line}; the hull of all masks covers {share:.0%} of them", warning
