"""Intermediate surfaces of a morph: one shape becomes another at a steady speed, while parts join or separate.

The start is the linear blend b = (1 - t) f_A + t f_B of the two signed distances. Its surface passes a point that only
one of the shapes contains at the arrival time T = f_A / (f_A - f_B). Thick parts move evenly; but a thin limb appears
or vanishes nearly at once, and a part that is thickest far from the other shape appears as a loose component. So the
arrival times are recomputed: they solve the eikonal equation |grad T| = max(|grad T_blend|, 1 / v), in which the
blend's front keeps its speed below v. A part that only B contains grows from the common part; a part that only A
contains shrinks in the same way, with time reversed.
"""

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .shape import Doubles, Surface, unit

CELLS = 72  # cells along each side of the grid
EXTENT = 1.06  # half the side of the grid's cube, model units
SEEDS = 200_000  # surface samples; grid vertices near them have exact distances
SOURCE = 1.5  # distance from the common part, in cells, up to which the blend sets the arrival times
FASTEST = 2.5  # largest speed of the surface: this multiple of the longest path, while t goes from 0 to 1
LOOSE = 0.6  # share of the time in which a part appears or vanishes that does not touch the other shape
NEVER = 1e6  # arrival time of vertices that no front reaches
SETTLED = 1e-5  # the solver stops if no time changes by more
SHELL = 2  # cells beyond a part at which its arrival times are known, so that the surface can be interpolated

Grid = NDArray[np.float32]
"""Values at the vertices of a grid, (cells + 1,) * 3, index [x, y, z]."""
Mask = NDArray[np.bool_]


def step_of(grid: Grid | Mask) -> float:
    """Return the side of a cell of a grid, model units."""
    return 2 * EXTENT / (len(grid) - 1)


def vertices_of(cells: int) -> Doubles:
    """Return the vertices of a grid, (cells + 1,) * 3 + (3,)."""
    axis = np.linspace(-EXTENT, EXTENT, cells + 1)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


def distances(shape: Surface, cells: int = CELLS) -> Grid:
    """Compute a shape's signed distance on a grid: exact beside the surface, elsewhere to the order of a cell."""
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
    # A region without exact distances has one sign: that of the vertices around it.
    regions, _ = ndimage.label(~near)
    cross = ndimage.generate_binary_structure(3, 1)
    around = ndimage.grey_dilation(np.where(near, np.where(inside, 2, 1), 0), footprint=cross)
    signs = ndimage.maximum(around * (regions > 0), regions, np.arange(regions.max() + 1))
    inside |= (np.asarray(signs) == 2)[regions] & (regions > 0)
    size = arrivals(size, near, np.ones_like(size), ~near)
    return np.where(inside, -size, size)


def arrivals(times: Grid, known: Mask, slowness: Grid, free: Mask) -> Grid:
    """Solve the eikonal equation |grad T| = slowness from known values, by Godunov's upwind scheme.

    known: vertices that keep their `times`. free: vertices to compute; fronts pass neither other vertices nor the
    grid's rim. Returns the times, `NEVER` where no front arrives.
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
    outer = rim & free & ~known
    if outer.any():  # the rim gets the times of the nearest inner vertices, plus one cell
        inner = np.clip(np.argwhere(outer), 1, len(free) - 2)
        result[outer] = np.minimum(result[tuple(inner.T)] + step_of(free), NEVER)
    return result


@dataclass(frozen=True, eq=False)
class Morph:
    """The surfaces between two shapes A and B, on a grid."""

    first: Grid
    """f_A."""
    second: Grid
    """f_B."""
    times: Grid
    """Arrival times T of the surface."""

    def field(self, time: float) -> Grid:
        """Return a function whose zero level set is the surface at a time in [0, 1], negative inside."""
        moving = (self.first - self.second) * (self.times - np.float32(time))
        lowest, highest = np.minimum(self.first, self.second), np.maximum(self.first, self.second)
        return np.asarray(np.clip(moving, lowest, highest), np.float32)


def morph(first: Grid, second: Grid) -> Morph:
    """Compute the arrival times between two shapes from their signed distances."""
    grows, shrinks = (first > 0) & (second < 0), (first < 0) & (second > 0)
    longest = max(_longest(first, grows), _longest(second, shrinks))
    slowest = 1 / max(FASTEST * longest, step_of(first))
    times = blend(first, second).times
    # Elsewhere, inside both or neither, the clipping of Morph.field reproduces the blend.
    growth, loss = _times(first, second, grows, slowest), 1 - _times(second, first, shrinks, slowest)
    for part, arrival in ((grows, growth), (shrinks, loss)):
        if part.any():
            shell = ndimage.binary_dilation(part, iterations=SHELL) & (first > 0) & (second > 0)
            nearest = ndimage.distance_transform_edt(~part, return_distances=False, return_indices=True)
            times = np.where(part, arrival, np.where(shell, arrival[tuple(nearest)], times))
    return Morph(first, second, np.asarray(times, np.float32))


def blend(first: Grid, second: Grid) -> Morph:
    """Return the linear blend of two signed distances."""
    difference = first - second
    times = first / np.where(np.abs(difference) < 1e-9, 1e-9, difference)
    return Morph(first, second, np.asarray(times, np.float32))


def _longest(start: Grid, part: Mask) -> float:
    """Measure the longest path through a part from the shape with distance `start`."""
    paths = arrivals(start, part & (start < SOURCE * step_of(start)), np.ones_like(start), part)
    reached = part & (paths < NEVER)
    return float(paths[reached].max()) if reached.any() else 0.0


def _times(start: Grid, end: Grid, part: Mask, slowest: float) -> Grid:
    """Compute arrival times in [0, 1] in a part that `end` contains and `start` does not. slowest: least |grad T|."""
    times = np.where(part, start / np.maximum(start - end, 1e-9), 0).astype(np.float32)
    # Differences across the part's boundary are ignored: T is not defined outside.
    slowness = np.zeros_like(times)
    for axis in range(3):
        step = np.diff(times, axis=axis) * (np.diff(part.astype(np.int8), axis=axis) == 0)
        ahead = np.pad(step, [(0, int(k == axis)) for k in range(3)])
        behind = np.pad(step, [(int(k == axis), 0) for k in range(3)])
        slowness += np.maximum(np.abs(ahead), np.abs(behind)) ** 2
    slowness = np.maximum(np.sqrt(slowness) / step_of(start), slowest).astype(np.float32)
    times = arrivals(times, part & (start < SOURCE * step_of(start)), slowness, part)
    reached = part & (times < NEVER)
    if reached.any():
        times[reached] /= max(1.0, float(times[reached].max()))
    loose = part & ~reached
    if loose.any():
        times[loose] = 1 - LOOSE * end[loose] / end[loose].min()
    return times


def triangles(values: Grid) -> tuple[Doubles, NDArray[np.int64], Doubles]:
    """Extract the zero level set: vertices (V, 3), outward faces (F, 3), and unit normals (V, 3)."""
    places = vertices_of(len(values) - 1).transpose(2, 1, 0, 3).reshape(-1, 3)  # in libigl, x varies fastest
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
    """Interpolate a grid linearly at points (N, 3), clamped to its rim. Returns (N,)."""
    places = ((points + EXTENT) / step_of(values)).T
    return np.asarray(ndimage.map_coordinates(values, places, order=1, mode="nearest"), np.float64)
