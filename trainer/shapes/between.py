"""Surfaces between two shapes: one becomes the other, at a steady speed, and parts join or part on the way.

The start is the blend b = (1 - t) f_A + t f_B of the two signed distances. Its surface passes a point that only one of
the shapes holds at the time T = f_A / (f_A - f_B). What is thick moves evenly so; but a thin limb goes or comes nearly
at once, and a part that is thickest away from the other shape comes as a loose piece. So arrival times are computed
anew: they solve the eikonal equation |grad T| = max(|grad T_blend|, 1 / v), in which the front of the blend keeps its
speed where that is below v. What one shape holds and the other does not is conquered from the common part, and its loss
is the same backwards in time.
"""

from dataclasses import dataclass
from typing import Protocol

import igl
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .shape import Doubles, SurfacePoints, unit

CELLS = 72
"""Cells along each side of the grid."""
EXTENT = 1.06
"""Half the side of the grid's cube, model units."""
SEEDS = 200_000
"""Points of a surface around which distances are exact."""
SOURCE = 1.5
"""Distance from the common part, in cells, up to which times are those of the blend."""
FASTEST = 2.5
"""Largest speed of the surface: so many times the longest way, while t goes from 0 to 1."""
LOOSE = 0.6
"""A part that does not touch the other shape comes at this share of the time, counted from the end, or goes so."""
NEVER = 1e6
"""Time of what is not reached."""
SETTLED = 1e-5
"""Change of times below which they are final."""
SHELL = 2
"""Cells beyond a part at which its times are known, for the surface to be found between them."""

Grid = NDArray[np.float32]
"""Values at the vertices of a grid, (cells + 1,) * 3, index [x, y, z]."""
Mask = NDArray[np.bool_]


class Measured(Protocol):
    """What is known of a shape whose distances are computed; `Shape` says what its methods give."""

    def surface(self, count: int, rng: np.random.Generator) -> SurfacePoints:
        """Draw points of the surface."""
        ...

    def distance(self, points: Doubles) -> Doubles:
        """Compute signed distances."""
        ...


def step_of(grid: Grid | Mask) -> float:
    """Return the side of a cell of a grid, model units."""
    return 2 * EXTENT / (len(grid) - 1)


def vertices_of(cells: int) -> Doubles:
    """Return the positions of the vertices of a grid with `cells` cells along each side: (cells + 1,) * 3 + (3,)."""
    axis = np.linspace(-EXTENT, EXTENT, cells + 1)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


def distances(shape: Measured, cells: int = CELLS) -> Grid:
    """Compute a shape's signed distance on a grid: exact beside the surface, farther away to the order of a cell.

    cells: along each side of the grid.
    """
    seeds = shape.surface(SEEDS, np.random.default_rng(0)).points
    near = np.zeros((cells + 1,) * 3, np.bool_)
    cell = np.clip(((seeds + EXTENT) / step_of(near)).astype(np.int64), 0, cells - 1)
    for corner in np.ndindex(2, 2, 2):
        near[tuple((cell + corner).T)] = True
    near = ndimage.binary_dilation(near)
    size = np.full(near.shape, NEVER, np.float32)
    exact = shape.distance(vertices_of(cells)[near])
    size[near] = np.abs(exact)
    inside = near.copy()
    inside[near] = exact < 0
    # A part that no exact distance is in has one sign: that of the vertices around it.
    parts, _ = ndimage.label(~near)
    cross = ndimage.generate_binary_structure(3, 1)
    around = ndimage.grey_dilation(np.where(near, np.where(inside, 2, 1), 0), footprint=cross)
    signs = ndimage.maximum(around * (parts > 0), parts, np.arange(parts.max() + 1))
    inside |= (np.asarray(signs) == 2)[parts] & (parts > 0)
    size = arrivals(size, near, np.ones_like(size), ~near)
    return np.where(inside, -size, size)


def arrivals(times: Grid, known: Mask, slowness: Grid, free: Mask) -> Grid:
    """Solve the eikonal equation |grad T| = slowness from known values, by Godunov's upwind scheme.

    times: what is known. known, free: vertices that keep their times, and those that get one; a front does not pass
    others, nor the grid's rim. Returns the times, `NEVER` where no front comes.
    """
    result = np.where(known, times, np.float32(NEVER)).astype(np.float32)
    rim = np.ones_like(free)
    rim[1:-1, 1:-1, 1:-1] = False
    flat, nodes = result.reshape(-1), np.flatnonzero(free & ~known & ~rim)
    cost = step_of(free) * slowness.reshape(-1)[nodes]
    strides = np.array([len(free) ** 2, len(free), 1])
    while len(nodes):
        a, b, c = np.sort([np.minimum(flat[nodes - stride], flat[nodes + stride]) for stride in strides], axis=0)
        new = a + cost
        two = (a + b + np.sqrt(np.maximum(2 * cost**2 - (a - b) ** 2, 0))) / 2
        new = np.where(new > b, two, new)
        spread = 2 * (a * a + b * b + c * c - a * b - b * c - c * a)
        three = (a + b + c + np.sqrt(np.maximum(3 * cost**2 - spread, 0))) / 3
        new = np.minimum(np.where(new > c, three, new), flat[nodes])
        change = float((flat[nodes] - new).max(initial=0))
        flat[nodes] = new
        if change < SETTLED:
            break
    return _off_rim(result, rim, free & ~known)


def _off_rim(values: Grid, rim: Mask, free: Mask) -> Grid:
    """Give free vertices on the grid's rim the value of the nearest ones within, and a cell more."""
    outer = rim & free
    if outer.any():
        inner = np.clip(np.argwhere(outer), 1, len(free) - 2)
        values[outer] = np.minimum(values[tuple(inner.T)] + step_of(free), NEVER)
    return values


@dataclass(frozen=True, eq=False)
class Between:
    """The surfaces between two shapes A and B, on the grid."""

    first: Grid
    """f_A."""
    second: Grid
    """f_B."""
    times: Grid
    """When the surface passes: T."""

    def field(self, time: float) -> Grid:
        """Return a function whose zero level set is the surface at a time in [0, 1], negative inside."""
        moving = (self.first - self.second) * (self.times - np.float32(time))
        lowest, highest = np.minimum(self.first, self.second), np.maximum(self.first, self.second)
        return np.asarray(np.clip(moving, lowest, highest), np.float32)


def between(first: Grid, second: Grid) -> Between:
    """Find the times at which the surface passes, from the distances of the two shapes."""
    comes, goes = (first > 0) & (second < 0), (first < 0) & (second > 0)
    longest = max(_longest(first, comes), _longest(second, goes))
    slowest = 1 / max(FASTEST * longest, step_of(first))
    times = blended(first, second).times
    # Where both or none are inside, the clipping of Between.field leaves the blend: its T is kept as it is.
    for part, late in ((comes, _late(first, second, comes, slowest)), (goes, 1 - _late(second, first, goes, slowest))):
        if part.any():
            shell = ndimage.binary_dilation(part, iterations=SHELL) & (first > 0) & (second > 0)
            nearest = ndimage.distance_transform_edt(~part, return_distances=False, return_indices=True)
            times = np.where(part, late, np.where(shell, late[tuple(nearest)], times))
    return Between(first, second, np.asarray(times, np.float32))


def blended(first: Grid, second: Grid) -> Between:
    """Return the surfaces of the blend of the distances of the two shapes."""
    difference = first - second
    times = first / np.where(np.abs(difference) < 1e-9, 1e-9, difference)
    return Between(first, second, np.asarray(times, np.float32))


def _longest(start: Grid, part: Mask) -> float:
    """Measure the longest way through a part from the shape of distance `start`."""
    ways = arrivals(start, part & (start < SOURCE * step_of(start)), np.ones_like(start), part)
    reached = part & (ways < NEVER)
    return float(ways[reached].max()) if reached.any() else 0.0


def _late(start: Grid, end: Grid, part: Mask, slowest: float) -> Grid:
    """Compute when a part is conquered that `end` holds and `start` does not, in [0, 1]. slowest: least |grad T|."""
    blend = np.where(part, start / np.maximum(start - end, 1e-9), 0).astype(np.float32)
    # Only differences inside the part count: those across its rim mix in what T is not defined by.
    slowness = np.zeros_like(blend)
    for axis in range(3):
        step = np.diff(blend, axis=axis) * (np.diff(part.astype(np.int8), axis=axis) == 0)
        ahead = np.pad(step, [(0, int(k == axis)) for k in range(3)])
        behind = np.pad(step, [(int(k == axis), 0) for k in range(3)])
        slowness += np.maximum(np.abs(ahead), np.abs(behind)) ** 2
    slowness = np.maximum(np.sqrt(slowness) / step_of(start), slowest).astype(np.float32)
    times = arrivals(blend, part & (start < SOURCE * step_of(start)), slowness, part)
    reached = part & (times < NEVER)
    if reached.any():
        times[reached] /= max(1.0, float(times[reached].max()))
    loose = part & ~reached
    if loose.any():
        times[loose] = 1 - LOOSE * end[loose] / end[loose].min()
    return times


def triangles(values: Grid) -> tuple[Doubles, NDArray[np.int64], Doubles]:
    """Extract the zero level set: vertices (V, 3), faces (F, 3) that look outwards, and unit normals (V, 3)."""
    places = vertices_of(len(values) - 1).transpose(2, 1, 0, 3).reshape(-1, 3)  # libigl counts x fastest
    column = values.transpose(2, 1, 0).reshape(-1).astype(np.float64)
    column = np.where(np.abs(column) < 1e-6, 1e-6, column)
    vertices, faces, _ = igl.marching_cubes(column, places, *values.shape, 0.0)
    if not len(faces):
        return np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty((0, 3))
    faces = np.asarray(faces, np.int64)
    corners = vertices[faces]
    normals = np.zeros_like(vertices)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for k in range(3):
        np.add.at(normals, faces[:, k], across)
    return np.asarray(vertices, np.float64), faces, unit(normals)


def interpolated(values: Grid, points: Doubles) -> Doubles:
    """Interpolate values of a grid at points (N, 3), linearly; beyond the grid as on its rim. Returns (N,)."""
    places = ((points + EXTENT) / step_of(values)).T
    return np.asarray(ndimage.map_coordinates(values, places, order=1, mode="nearest"), np.float64)
