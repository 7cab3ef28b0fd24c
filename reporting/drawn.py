"""The pictures of a report: each level, a slice of the field with its bands, and the surface's error as colours."""

import base64
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..codegen.targets import orbit
from ..codegen.targets.camera import basis, fitting_distance
from ..field.evaluate import Evaluator
from ..field.trace import trace
from ..ir.lower import lower
from ..model.image_file import png_bytes
from ..model.model import Model, shape_of
from ..web import page as webpage

SIDE = 256
"""Pixels of a picture, along each side."""
SLICE = 384
"""Pixels of the slice."""
WORST = 1e-2
"""Distance at the far end of the error's colours, radii of the shape."""
BEST = 1e-5
"""At their near end."""
RAMP = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], np.float64)
"""Colours from BEST to WORST, evenly spaced on a logarithmic axis: those of matplotlib's viridis."""
OUTSIDE, INSIDE = np.array([236.0, 240, 246]), np.array([250.0, 226, 200])
"""Colours of the slice away from bands."""
BANDS = np.array([[190.0, 214, 240], [150, 186, 226], [112, 156, 208], [84, 128, 188]])
"""Of the places where finer levels answer, from level 2 on; the last also of those after it."""

Picture = NDArray[np.uint8]
Doubles = NDArray[np.float64]


def levels(model: Model) -> Iterator[tuple[str, Picture]]:
    """Draw the model up to each of its levels, and with its colours at last: what each is called, and its picture."""
    for i, level in enumerate(model.levels, start=1):
        part = replace(model, levels=model.levels[:i], texture=None)
        yield f"level {i} ({shape_of(level.network)})", webpage.poster_pixels(part, SIDE)
    if model.texture is not None:
        yield f"texture ({shape_of(model.texture)})", webpage.poster_pixels(model, SIDE)


def slice_of(model: Model) -> Picture:
    """Draw the field on the plane x = 0, z to the right and y up: its sign, lines of equal distance, and its bands.

    The surface is black; lines are 0.1 apart, of the field at time 0.
    """
    axis = (np.arange(SLICE) + 0.5) * 2 / SLICE - 1
    z, y = np.meshgrid(axis, -axis)
    points = np.stack((np.zeros_like(z), y, z), axis=-1).reshape(-1, 3)
    f, reached = Evaluator(model).nested(points.astype(np.float32), len(model.levels))
    f, reached = f.reshape(SLICE, SLICE), reached.reshape(SLICE, SLICE)
    image = np.where(f[..., None] < 0, INSIDE, OUTSIDE)
    finer = reached > 1
    image[finer] = BANDS[np.minimum(reached[finer] - 2, len(BANDS) - 1)]
    image[_changes(np.floor(f / 0.1))] *= 0.8
    image[_changes(f < 0)] = 0
    return image.astype(np.uint8)


def errors(model: Model, distance: Callable[[Doubles], Doubles]) -> tuple[list[Picture], NDArray[np.float64]]:
    """Draw the surface, from the front and from behind, in colours of its distance to the truth; see RAMP.

    distance: gives the distances (N,) of points (N, 3), model space, to the truth. Returns the pictures, and the
    distances of all pixels that show the surface.
    """
    evaluator, program = Evaluator(model), lower(model)
    focal = 1 / math.tan(math.radians(orbit.FOV) / 2)
    azimuth, elevation = model.front or (orbit.AZIMUTH, orbit.ELEVATION)
    pictures, found = [], []
    centre = (np.arange(SIDE) + 0.5) * 2 / SIDE - 1
    x, y = np.meshgrid(centre, -centre)
    for turn in (0.0, 180.0):
        axes = basis(azimuth + turn, elevation)
        eye = fitting_distance(1.0, focal) * axes[:, 2]
        along = np.stack((x, y, np.full_like(x, -focal)), axis=-1).reshape(-1, 3) @ axes.T
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        origins = np.tile(eye, (len(along), 1))
        t = trace(model, evaluator, origins, along, len(program.values))
        hit = np.isfinite(t)
        points = origins[hit] + t[hit, None] * along[hit]
        off = distance(points)
        normals = evaluator.gradient(points, len(program.values)).astype(np.float64)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        light = 0.55 + 0.45 * np.abs((normals * along[hit]).sum(axis=1))
        image = np.zeros((SIDE * SIDE, 4))
        image[hit] = np.column_stack((coloured(off) * light[:, None], np.full(len(off), 255)))
        pictures.append(image.reshape(SIDE, SIDE, 4).astype(np.uint8))
        found.append(off)
    return pictures, np.concatenate(found)


def coloured(distances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the colours (N, 3), 0 to 255, of distances (N,)."""
    share = np.log(np.clip(distances, BEST, WORST) / BEST) / math.log(WORST / BEST)
    return np.column_stack([np.interp(share, np.linspace(0, 1, len(RAMP)), channel) for channel in RAMP.T])


def legend() -> Picture:
    """Draw the colours of `errors` from BEST on the left to WORST on the right: (1, SIDE, 3)."""
    return coloured(np.geomspace(BEST, WORST, SIDE))[None].astype(np.uint8)


def url(picture: Picture) -> str:
    """Write a picture as the URL of a PNG."""
    return "data:image/png;base64," + base64.b64encode(png_bytes(picture, optimize=True)).decode()


def _changes(values: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Where a pixel differs from the one to its left, or from the one above it."""
    changed = np.zeros(values.shape, np.bool_)
    changed[:, 1:] |= values[:, 1:] != values[:, :-1]
    changed[1:] |= values[1:] != values[:-1]
    return changed


class Distances:
    """Distances of points to a mesh in a file."""

    def __init__(self, model: Model, path: Path) -> None:
        """Read the mesh, and put it where the model has the shape at time 0. Raises UserError."""
        from ..mesher.at_time import place_at
        from ..mesher.metrics import SampledSurface
        from ..mesher.truth import in_model_space, read_mesh

        self._surface = SampledSurface(in_model_space(read_mesh(path), *place_at(model, 0.0)))

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances (N,) of points (N, 3), model space."""
        return self._surface.distance(points)[0]
