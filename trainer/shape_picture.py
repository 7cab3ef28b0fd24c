"""A picture of a shape before its training: its points from two sides, without OpenGL."""

import numpy as np
from numpy.typing import NDArray

from .shapes.shape import Doubles, Shape

SIDE = 512
"""Pixels along a side of each of the two views."""
SAMPLES = 600_000  # points that are drawn of a mesh
VIEWS = ((30.0, 20.0), (210.0, -20.0))
"""Degrees around and above of the two views."""
SPREAD = 1.1  # half the side of a point, in spacings, where points are few
MARGIN = 1.08  # half the side of a view, in radii of the shape
BACKGROUND = (1.0, 1.0, 1.0)
PLAIN = (0.72, 0.72, 0.74)
MOST_REACH = 15  # pixels
GRAZING = -0.25  # normals with a smaller cosine to the eye are seen from inside; others may be of the outline
INSIDE = (0.85, 0.1, 0.1)
LIGHT = (0.4, 0.6, 0.7)
"""Towards the light, in the view's axes: right, up, to the eye."""


def drawn(shape: Shape, size: int = SIDE) -> NDArray[np.uint8]:
    """Draw a shape from two sides: (size, 2 size, 3). Points whose normals point away from the eye are red."""
    count = min(SAMPLES, len(shape.inputs())) if shape.cloud else SAMPLES
    surface = shape.surface(count, np.random.default_rng(0), colors=shape.colored)
    colors = np.tile(PLAIN, (count, 1)) if surface.colors is None else surface.colors
    views = [_view(surface.points, surface.normals, colors, *angles, size) for angles in VIEWS]
    return np.round(255 * np.concatenate(views, axis=1)).astype(np.uint8)


def _view(points: Doubles, normals: Doubles, colors: Doubles, azimuth: float, elevation: float, size: int) -> Doubles:
    """Draw squares of the points' spacing, nearest last: (size, size, 3)."""
    a, e = np.radians((azimuth, elevation))
    eye = np.array((np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)))
    right = np.array((np.cos(a), 0.0, -np.sin(a)))
    axes = np.stack((right, np.cross(eye, right), eye))
    x, y, depth = axes @ points.T
    shade = normals @ (axes.T @ (np.array(LIGHT) / np.linalg.norm(LIGHT)))
    facing = normals @ eye
    lit = colors * (0.35 + 0.65 * np.clip(shade, 0, 1))[:, None]
    lit = np.where(facing[:, None] < GRAZING, INSIDE, lit)
    pixel = size / (2 * MARGIN)
    spread = SPREAD if len(points) < SAMPLES else 0.75
    reach = int(np.clip(np.ceil(spread * pixel * np.sqrt(4 * np.pi / len(points))), 0, MOST_REACH))
    columns, rows = ((np.array(at) * pixel + size / 2).astype(np.int64) for at in (x, -y))
    nearest = np.full(size * size, -np.inf)
    picture = np.tile(np.array(BACKGROUND), (size * size, 1))
    order = np.argsort(depth)  # of several points in a pixel, NumPy keeps the last
    for down in range(-reach, reach + 1):
        for across in range(-reach, reach + 1):
            row, column = rows[order] + down, columns[order] + across
            there = (row >= 0) & (row < size) & (column >= 0) & (column < size)
            place, which = (row * size + column)[there], order[there]
            front = np.full(size * size, -1, np.int64)
            front[place] = which
            seen = np.flatnonzero(front >= 0)
            seen = seen[depth[front[seen]] > nearest[seen]]
            nearest[seen] = depth[front[seen]]
            picture[seen] = lit[front[seen]]
    return picture.reshape(size, size, 3)
