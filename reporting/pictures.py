"""The pictures of a report: each level, a slice of the field with its bands, and the error of the surface."""

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
from ..model.image_file import png_bytes
from ..model.model import Model, size_text
from ..web.page import poster_pixels

SIDE, SLICE = 256, 384
"""Pixels along each side of a picture, and of the slice."""
BEST, WORST = 1e-5, 1e-2
"""Ends of the color scale of the error, radii of the shape."""
RAMP = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], np.float64)
"""Colors from BEST to WORST, evenly spaced on a logarithmic axis: matplotlib's viridis."""
OUTSIDE, INSIDE = np.array([236.0, 240, 246]), np.array([250.0, 226, 200])
"""Colors of the slice outside the bands."""
BANDS = np.array([[190.0, 214, 240], [150, 186, 226], [112, 156, 208], [84, 128, 188]])
"""Colors where level 2, 3, ... answers; the last one for all further levels."""

Picture = NDArray[np.uint8]
Doubles = NDArray[np.float64]


def levels(model: Model) -> Iterator[tuple[str, Picture]]:
    """Draw the model up to each level, and finally with its colors. Yields titles and pictures."""
    for i, level in enumerate(model.levels, start=1):
        part = replace(model, levels=model.levels[:i], texture=None)
        yield f"level {i} ({size_text(level.network)})", poster_pixels(part, SIDE)
    if model.texture is not None:
        yield f"texture ({size_text(model.texture)})", poster_pixels(model, SIDE)


def slice_of(model: Model) -> Picture:
    """Draw the field on the plane x = 0 at time 0, z to the right and y up: sign, contours 0.1 apart, and bands."""
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


def errors(model: Model, distance: Callable[[Doubles], Doubles]) -> tuple[list[Picture], Doubles]:
    """Draw the surface from the front and from behind, colored by its distance to the truth, see RAMP.

    distance: maps points (N, 3), model space, to distances (N,). Returns the pictures, and the distances at all pixels
    that show the surface.
    """
    evaluator, last = Evaluator(model), len(model.levels)
    focal = 1 / math.tan(math.radians(orbit.FOV) / 2)
    azimuth, elevation = model.front or (orbit.AZIMUTH, orbit.ELEVATION)
    pictures, found = [], []
    center = (np.arange(SIDE) + 0.5) * 2 / SIDE - 1
    x, y = np.meshgrid(center, -center)
    for turn in (0.0, 180.0):
        axes = basis(azimuth + turn, elevation)
        along = np.stack((x, y, np.full_like(x, -focal)), axis=-1).reshape(-1, 3) @ axes.T
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        origins = np.tile(fitting_distance(1.0, focal) * axes[:, 2], (len(along), 1))
        t = trace(model, evaluator, origins, along, last)
        hit = np.isfinite(t)
        points = origins[hit] + t[hit, None] * along[hit]
        found.append(distance(points))
        normals = evaluator.gradient(points, last).astype(np.float64)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        light = 0.55 + 0.45 * np.abs((normals * along[hit]).sum(axis=1))
        image = np.zeros((SIDE * SIDE, 4))
        image[hit] = np.column_stack((colors_of(found[-1]) * light[:, None], np.full(len(points), 255)))
        pictures.append(image.reshape(SIDE, SIDE, 4).astype(np.uint8))
    return pictures, np.concatenate(found)


def colors_of(distances: Doubles) -> Doubles:
    """Map distances (N,) to colors (N, 3), 0 to 255."""
    share = np.log(np.clip(distances, BEST, WORST) / BEST) / math.log(WORST / BEST)
    return np.column_stack([np.interp(share, np.linspace(0, 1, len(RAMP)), channel) for channel in RAMP.T])


def legend() -> Picture:
    """Draw the colors from BEST on the left to WORST on the right: (1, SIDE, 3)."""
    return colors_of(np.geomspace(BEST, WORST, SIDE))[None].astype(np.uint8)


def url(picture: Picture) -> str:
    """Write a picture as the data URL of a PNG."""
    return "data:image/png;base64," + base64.b64encode(png_bytes(picture, optimize=True)).decode()


def _changes(values: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Mark pixels that differ from the left or the upper neighbor."""
    changed = np.zeros(values.shape, np.bool_)
    changed[:, 1:] |= values[:, 1:] != values[:, :-1]
    changed[1:] |= values[1:] != values[:-1]
    return changed


class Distances:
    """Measures distances to the mesh in a file."""

    def __init__(self, model: Model, path: Path, *, follow: bool = False) -> None:
        """Read the mesh, and place it as the model's shape at time 0. follow: of `read_mesh`. Raises UserError."""
        from ..mesher.at_time import place_at
        from ..mesher.metrics import SampledSurface
        from ..mesher.read_meshes import in_model_space, read_mesh

        self._surface = SampledSurface(in_model_space(read_mesh(path, follow=follow), *place_at(model, 0.0)))

    def __call__(self, points: Doubles) -> Doubles:
        """Return the distances (N,) of points (N, 3), model space."""
        return self._surface.distance(points)[0]
