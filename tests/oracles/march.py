"""Multiscale sphere tracing (Section 3.2, Appendix C) in NumPy, step by step as march.glsl and skip.glsl.

The tests compare the shaders' steps with it; the benchmarks count with it what a frame costs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mplicits.field.cell_codes import EMPTY, interpolated
from mplicits.field.cells import LOOKUPS, NEAR, Cells
from mplicits.field.half_widths import SHARES, Grid, cells_of
from mplicits.field.interpret import field_gradient, nested_field
from mplicits.field.trace import enter_ball
from mplicits.ir.program import Array, Program
from mplicits.model.model import DELTA_FACTOR

Doubles = NDArray[np.float64]
Indices = NDArray[np.intp]

STOP = 0.05
"""Pixels to the surface within which a ray stops."""
FLATTEST = 0.1
"""Smallest slope of f along a ray that predicts how far the surface is."""
STEEPEST = 4.0
"""Largest slope between a free sphere and a point inside the shape; above it, the sphere was not free."""
GAP = 0.005
"""Largest gap between two free spheres, model units; the gap is a pixel where a pixel is smaller."""
STEEP = 0.4
"""Smallest slope of f along a ray at which a gradient step may end the ray (glsl/passes/gradient.glsl)."""
LAST = 0.5
"""Largest length of that step, pixels."""
ROUND = 0.008
"""Smallest radius of curvature, model units, at which that step ends within 1/20 pixel of the surface."""
CLOSE = 0.2
"""Distance to the surface by the grid, pixels, below which rays evaluate the field."""


def ball(origin: Doubles, directions: Doubles, radius: float) -> tuple[Doubles, Doubles, NDArray[np.bool_]]:
    """Intersect rays (N, 3) from one origin (3,) with a ball, see field/trace.py."""
    return enter_ball(origin, directions, radius)


def half_widths(program: Program, grids: Sequence[Grid], points: Array) -> Doubles:
    """Return delta of all levels' bands at points (N, 3), (L, N). grids: of `narrow_widths`, for the first levels."""
    deltas = np.array([band.delta for band in program.bands])
    widths = np.repeat(deltas[:, None], len(points), axis=1)
    for i, grid in enumerate(grids):
        x, y, z = cells_of(points, len(grid)).T
        widths[i] *= grid[z, y, x] / SHARES
    return widths


def margins(program: Program, widths: Doubles) -> list[Doubles]:
    """Return the `margins` argument of interpret.nested_levels for bands of half widths (L, N)."""
    return [width - band.delta for width, band in zip(widths[:-1], program.bands, strict=False)]


@dataclass(eq=False)
class Skipping:
    """Moves N rays over the empty cells of a grid, of a field that does not move (glsl/functions/skip.glsl)."""

    cells: Cells
    origin: Doubles
    """(3,), model space."""
    directions: Doubles
    """(N, 3) of length 1."""
    footprint: float
    """Width of a pixel at distance 1."""
    step_scale: float
    lookups: NDArray[np.int64]
    """(N,), at most LOOKUPS."""

    def skip(self, indices: Indices, t: Doubles, far: Doubles, last_sphere: Doubles) -> None:
        """Move the rays `indices` to where the surface may be, or beyond `far`; changes `t` and `last_sphere`.

        t: (N,) distances; last_sphere: (N, 2) distance and radius of the last free sphere, radius 0 for none.
        """
        codes, count = self.cells.grid(), self.cells.count
        scale = 0.5 * count / self.cells.half
        along = scale * self.directions
        along = np.where(along == 0, 1e-6, along)
        active = indices[t[indices] <= far[indices]]
        while len(active):
            active = active[self.lookups[active] < LOOKUPS]
            self.lookups[active] += 1
            place = scale * (self.origin + self.cells.half) + t[active, None] * along[active]
            cell = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
            code = codes[cell[:, 2], cell[:, 1], cell[:, 0]]
            empty = code < EMPTY
            step = np.zeros(len(active))
            edge = (1 << code[empty].astype(np.int64))[:, None]
            corner = cell[empty] // edge * edge
            leaving = (corner + np.where(along[active[empty]] > 0, edge, 0) - place[empty]) / along[active[empty]]
            step[empty] = np.maximum(leaving.min(axis=1), 0) + 1e-3 / scale
            step[~empty] = self.step_scale * interpolated(codes, place[~empty]) / scale
            goes = empty | (step > CLOSE * self.footprint * t[active])
            active, step, empty = active[goes], step[goes], empty[goes]
            last_sphere[active] = np.stack([t[active], np.where(empty, 0, step)], axis=1)
            t[active] += step
            active = active[t[active] <= far[active]]


@dataclass(frozen=True, eq=False)
class TraceSettings:
    """Settings of one trace."""

    level: int
    """Number of the traced level, from 1."""
    footprint: float
    """Width of a pixel at distance 1, model units."""
    bounds: Doubles
    """(L,) factors on the steps of the levels."""
    near: float

    def free_radius(self, f: Array, widths: Doubles, reached: NDArray[np.int64]) -> Doubles:
        """Return the radii (M,) of free spheres; f, reached: value and level; widths: delta there; all (M,)."""
        return self.bounds[reached - 1] * np.where(reached == self.level, f, f - widths / DELTA_FACTOR)


@dataclass(eq=False)
class Rays:
    """N rays, and the number of evaluations so far."""

    t: Doubles
    """(N,) distance from the origin."""
    far: Doubles
    """(N,) distance at which a ray leaves the ball."""
    level: NDArray[np.int64]
    """(N,) level of the next step, 0 for finished rays."""
    steps: NDArray[np.int64]
    """(N,) number of steps."""
    hit: NDArray[np.bool_]
    """(N,) whether the ray has met the surface."""
    evaluations: list[int]
    """Evaluations of each level's network, at index level - 1."""
    last_sphere: Doubles
    """(N, 2) distance from the origin and radius of the last free sphere; radius 0 for none."""
    gradient_evaluations: int = 0
    """Evaluations of the gradient for rays that then continued."""
    traced: list[list[int]] = field(default_factory=list)
    """Rays in each phase of each round of the plain schedule, [round][level - 1]."""
    evaluations_outside: int = 0
    """Evaluations of level 1's network for rays at level 1, in the plain schedule."""

    def advance(
        self,
        indices: Indices,
        f: Array,
        widths: Doubles,
        reached: NDArray[np.int64],
        settings: TraceSettings,
    ) -> None:
        """Move the rays `indices` (M,) by one plain step: down one level inside the band, else along the ray.

        f, reached: (M,) value and level of the field at the rays; widths: (M,) delta of that level there.
        """
        self.steps[indices] += 1
        entered = (reached == self.level[indices]) & (reached < settings.level) & (np.abs(f) < widths)
        self.level[indices[entered]] += 1
        indices, f, widths, reached = indices[~entered], f[~entered], widths[~entered], reached[~entered]
        self._move(indices, settings.free_radius(f, widths, reached), f, reached, settings)

    def stride(
        self,
        indices: Indices,
        f: Array,
        widths: Doubles,
        reached: NDArray[np.int64],
        settings: TraceSettings,
    ) -> None:
        """Move rays by one over-relaxed step. Arguments as for `advance`."""
        self.steps[indices] += 1
        pixel, radius = settings.footprint * self.t[indices], settings.free_radius(f, widths, reached)
        at, free = self.last_sphere[indices].T
        moved = self.t[indices] - at
        known = (free > 0) & (moved > 0)
        gap = np.minimum(pixel, GAP)
        apart = known & (radius > 0) & (moved > free + radius + gap) & (moved > 1.00001 * free)
        back = indices[apart]
        self.t[back], self.hit[back], self.level[back], self.last_sphere[back, 1] = at[apart] + free[apart], False, 1, 0
        slope = np.where(known, (free - radius) / np.where(known, moved, 1), 1)
        nearest = np.maximum(slope, 0)
        expected = radius / np.maximum(
            nearest, np.where((self.steps[indices] > 1) & (f >= STOP * pixel), FLATTEST, 0.5)
        )
        ahead = np.minimum(0.9 * (2 * radius / (1 + nearest) + gap), expected)
        past = known & (radius < 0)
        change = np.where(known & (radius > 0) & (radius < settings.near * gap), np.maximum(ahead, radius), radius)
        change[past] = radius[past] / np.minimum(slope[past], STEEPEST)
        kept = ~past & ~apart
        self.last_sphere[indices[kept]] = np.stack([self.t[indices[kept]], radius[kept]], axis=1)
        self._move(indices[~apart], change[~apart], f[~apart], reached[~apart], settings)

    def gradient_step(
        self,
        indices: Indices,
        f: Array,
        widths: Doubles,
        reached: NDArray[np.int64],
        slope: Doubles,
        settings: TraceSettings,
    ) -> None:
        """Move rays by their first over-relaxed step, by Newton's where that reaches the surface (gradient.glsl).

        slope: (M,) of f along the rays, positive where f falls; other arguments as for `advance`.
        """
        change = f / np.maximum(slope, STEEP)
        end = self.t[indices] + change
        arrived = (reached == settings.level) & (slope > STEEP) & (end <= self.far[indices])
        pixel = settings.footprint * self.t[indices]
        arrived &= (np.abs(change) < LAST * pixel) & (change**2 < 2 * ROUND * 0.05 * pixel)
        there = indices[arrived]
        self.t[there], self.hit[there], self.level[there] = end[arrived], True, 0
        self.steps[there] += 1
        self.stride(indices[~arrived], f[~arrived], widths[~arrived], reached[~arrived], settings)

    def _move(
        self,
        indices: Indices,
        change: Doubles,
        f: Array,
        reached: NDArray[np.int64],
        settings: TraceSettings,
    ) -> None:
        """Move rays by a step (M,), and record hits and finished rays."""
        last, pixel = reached == settings.level, settings.footprint * self.t[indices]
        self.t[indices] += change
        left = (self.t[indices] > self.far[indices]) | (self.t[indices] < 0)
        self.hit[indices] = last & (f < 0.5 * pixel) & ~left
        self.level[indices] = np.where((last & (np.abs(f) < STOP * pixel)) | left, 0, reached)


def march(
    program: Program,
    origin: Doubles,
    directions: Doubles,
    level: int,
    footprint: float,
    rounds: int = 64,
    step_scale: float = 1.0,
    schedule: str = "plain",
    cells: Cells | None = None,
    narrow: Sequence[Grid] = (),
    newton_steps: int = 0,
    near: float = NEAR,
    late: bool = False,
) -> Rays:
    """Trace f_level along rays.

    origin: (3,); directions: (N, 3) of length 1, model space. footprint: width of a pixel at distance 1. rounds: passes
    through the levels; step_scale: factor on every step, beside the bound of each level. schedule: "plain" or
    "relaxed". cells: the grid that over-relaxed rays skip, if `level` is the last. narrow: from `narrow_widths`, for
    the first levels. newton_steps: number of over-relaxed steps that evaluate the gradient (gradient.glsl). late:
    whether one over-relaxed step precedes these (glsl/functions/trace_with_normal.glsl).
    """
    bounds = np.array([band.band_step_bound for band in program.bands])
    bounds[level - 1] = program.bands[level - 1].step_bound
    settings = TraceSettings(level, footprint, step_scale * bounds, near)
    t, far, meets = ball(origin, directions, 1.0 + program.bands[level - 1].delta)
    none, never = np.zeros(len(t), np.int64), np.zeros(len(t), np.bool_)
    rays = Rays(t, far, np.where(meets, 1, 0), none, never, [0] * level, np.zeros((len(t), 2)))
    relaxed = schedule == "relaxed"
    lookups = np.zeros(len(t), np.int64)
    skipping = None if cells is None else Skipping(cells, origin, directions, footprint, step_scale, lookups)

    def points_of(active: Indices) -> Array:
        return (origin + rays.t[active, None] * directions[active]).astype(np.float32)

    def nested(active: Indices, deepest: int) -> tuple[Array, Doubles, NDArray[np.int64]]:
        points = points_of(active)
        widths = half_widths(program, narrow, points)
        f, reached = nested_field(program, points, deepest, margins=margins(program, widths) if narrow else None)
        return f, widths[reached - 1, np.arange(len(points))], reached

    def evaluate(active: Indices, deepest: int) -> tuple[Array, Doubles, NDArray[np.int64]]:
        f, widths, reached = nested(active, deepest)
        for i in range(deepest):
            rays.evaluations[i] += int(np.count_nonzero(reached > i))
        return f, widths, reached

    def skip_empty_cells() -> None:
        far_out = np.flatnonzero((rays.level == 1) & (rays.t > 0))  # t = 0: the eye may be inside the shape
        if skipping is not None:
            skipping.skip(far_out, rays.t, rays.far, rays.last_sphere)
            rays.level[far_out[rays.t[far_out] > rays.far[far_out]]] = 0

    def step() -> None:
        skip_empty_cells()
        active = np.flatnonzero(rays.level > 0)
        rays.stride(active, *evaluate(active, level), settings)

    if late:
        step()
        lookups[:] = 0
    for _ in range(newton_steps):
        skip_empty_cells()
        active = np.flatnonzero(rays.level > 0)
        gradients, _ = field_gradient(program, points_of(active), level)
        slope = -(gradients * directions[active]).sum(axis=1)
        rays.gradient_step(
            active, *nested(active, level), slope, settings
        )  # the gradient functions return the values, too
        rays.gradient_evaluations += int(np.count_nonzero((rays.level > 0)[active]))
        lookups[:] = 0
    for _ in range(rounds):
        if not (rays.level > 0).any():
            break
        if relaxed:
            for _ in range(program.bands[level - 1].iterations):
                step()
            continue
        rays.traced.append([])
        for phase in range(1, level + 1):
            active = np.flatnonzero(rays.level == phase)
            rays.traced[-1].append(len(active))
            for _ in range(program.bands[phase - 1].iterations):
                if not len(active):
                    break
                rays.evaluations_outside += len(active) if phase == 1 else 0
                rays.advance(active, *evaluate(active, phase), settings)
                active = active[rays.level[active] == phase]
    return rays
