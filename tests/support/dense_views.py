"""Compares sphere tracing with dense marching on ten views of a model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mplicits.codegen.targets.glsl330 import bake
from mplicits.ir.lower import lower
from mplicits.model.model import Model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from oracles.dense import dense_march

VIEWS = [Camera(azimuth=36 * i + 10, elevation=(-30, 0, 25, 50)[i % 4]) for i in range(10)]
STOP = 0.05
"""Distance from the surface, pixels, below which a ray may count as a hit or a miss (glsl/functions/march.glsl)."""


@dataclass
class Difference:
    """Differences between the pictures of all views, in numbers of pixels."""

    holes: int
    """Hits of dense marching that sphere tracing misses."""
    extra: int
    """Hits of sphere tracing whose rays stay away from the surface by dense marching."""
    outline: int
    """Pixels on the silhouettes."""
    apart: NDArray[np.float32]
    """Distance between the two hit points of a ray, for each common hit, model units."""


def compare(model: Model, context: Context, side: int) -> Difference:
    """Compare sphere tracing of all levels, drawn in `context`, with dense marching of the last level.

    side: pixels per side of each view.
    """
    program, renderer = lower(model), Renderer(context, bake(model))
    total, apart = Difference(0, 0, 0, np.empty(0, np.float32)), []
    for camera in VIEWS:
        eye, directions, footprint = camera.rays(side, side)
        marched = dense_march(program, eye, directions.reshape(-1, 3), len(model.levels), footprint)
        closest, t = (values.reshape(side, side) for values in marched)
        traced = renderer.render((side, side), camera, RenderOptions(shade="data"))
        meets, hit = closest == 0, traced[..., 3] > 0.5
        total.holes += int((meets & ~hit).sum())
        total.extra += int((hit & (closest > STOP)).sum())
        total.outline += int(silhouette(meets).sum())
        apart.append(np.abs(traced[..., 0] - t)[meets & hit])
    renderer.release()
    total.apart = np.concatenate(apart)
    return total


def silhouette(hit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Find the pixels (H, W) with a neighbor on the other side of the outline."""
    edge = np.zeros_like(hit)
    edge[1:] |= hit[1:] ^ hit[:-1]
    edge[:-1] |= hit[1:] ^ hit[:-1]
    edge[:, 1:] |= hit[:, 1:] ^ hit[:, :-1]
    edge[:, :-1] |= hit[:, 1:] ^ hit[:, :-1]
    return edge
