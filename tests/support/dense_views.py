"""Ten views of a model, sphere-traced and marched densely."""

from dataclasses import dataclass

import numpy as np
from mplicits.codegen.ir.lower import lower
from mplicits.codegen.reference.dense import dense_march
from mplicits.codegen.targets.glsl330 import bake
from mplicits.model.model import Model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from numpy.typing import NDArray

VIEWS = [Camera(azimuth=36 * i + 10, elevation=(-30, 0, 25, 50)[i % 4]) for i in range(10)]
STOP = 0.05
"""Pixels: a ray that passes the surface this close may count as a hit or not (glsl/march.glsl)."""


@dataclass
class Difference:
    """Pixels over all views: holes (met by dense marching, missed by us), extra (the reverse), outline.

    apart: distance along the ray between the two, where both hit.
    """

    holes: int
    extra: int
    outline: int
    apart: NDArray[np.float32]


def compare(model: Model, context: Context, side: int) -> Difference:
    """Sphere tracing of all levels in `context` against dense marching of the last one, at side x side pixels."""
    program, renderer = lower(model), Renderer(context, bake(model))
    total, apart = Difference(0, 0, 0, np.empty(0, np.float32)), []
    for camera in VIEWS:
        eye, directions, pixel = camera.rays(side, side)
        found = dense_march(program, eye, directions.reshape(-1, 3), len(model.levels), pixel)
        closest, t = (part.reshape(side, side) for part in found)
        ours = renderer.render((side, side), camera, RenderOptions(shading="data"))
        hit, seen = closest == 0, ours[..., 3] > 0.5
        total.holes += int((hit & ~seen).sum())
        total.extra += int((seen & (closest > STOP)).sum())
        total.outline += int(silhouette(hit).sum())
        apart.append(np.abs(ours[..., 0] - t)[hit & seen])
    renderer.release()
    total.apart = np.concatenate(apart)
    return total


def silhouette(hit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels with a neighbour on the other side of the outline."""
    edge = np.zeros_like(hit)
    edge[1:] |= hit[1:] ^ hit[:-1]
    edge[:-1] |= hit[1:] ^ hit[:-1]
    edge[:, 1:] |= hit[:, 1:] ^ hit[:, :-1]
    edge[:, :-1] |= hit[:, 1:] ^ hit[:, :-1]
    return edge
