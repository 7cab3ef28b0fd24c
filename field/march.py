"""Multiscale sphere tracing (Section 3.2, Appendix C) in numpy, step by step as glsl/march.glsl does it.

It counts what a frame costs, and the shaders' steps are compared with its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .cells import Cells
from .interpret import field_gradient, nested_field
from .narrow import OFFSET, Grid, half_widths, margins
from .skip import Skipping

NEAR, NEAR_ALONE = 1.0, 2.0
"""Radius of a free sphere, in gaps, above which a relaxed step is a plain one: with a fine grid of cells, and in
shaders that stand alone (glsl/skip.glsl)."""
STEEPEST = 4.0
"""Slope between a free sphere and a point inside the shape above which the sphere is taken to be none."""
GAP = 0.005
"""Largest gap between two free spheres, model units, where a pixel is wider than that; else, a pixel."""
STEEP = 0.4
"""Least slope of f along a ray for a last step by the gradient (glsl/normals.glsl)."""
LAST = 0.5
"""Greatest length of that step, pixels."""
ROUND = 0.008
"""Radius of curvature, model units: where the shape is rounder, that step ends within 1/20 pixel of the surface."""


def ball(
    origin: NDArray[np.float64], directions: NDArray[np.float64], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Intersect rays with the ball of a radius around 0.

    origin: (3,), of all rays; directions: (N, 3) of length 1, model space. Returns the distances (N,) at which rays
    enter, at least 0, and leave, and whether they meet the ball (N,).
    """
    b = directions @ origin
    discriminant = b * b - origin @ origin + radius * radius
    half = np.sqrt(np.maximum(discriminant, 0))
    return np.maximum(-b - half, 0), half - b, (discriminant > 0) & (half - b > 0)


@dataclass(frozen=True, eq=False)
class TraceSettings:
    """What sphere tracing is asked for."""

    level: int
    """The level that is traced, counted from 1."""
    footprint: float
    """Width of a pixel at distance 1, model units."""
    bounds: NDArray[np.float64]
    """(L,) factors on the steps of all levels, of `level` as the last."""
    near: float
    """NEAR or NEAR_ALONE."""

    def free_radius(self, f: Array, widths: NDArray[np.float64], reached: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the radii (M,) of spheres that are free of the shape, by the field f (M,) of level `reached` (M,).

        widths: (M,) half widths of this level's band there.
        """
        return self.bounds[reached - 1] * np.where(reached == self.level, f, f - widths / OFFSET)


@dataclass(eq=False)
class Rays:
    """N rays on their way, and what they have cost so far."""

    t: NDArray[np.float64]
    """(N,) distance from the origin."""
    far: NDArray[np.float64]
    """(N,) distance at which a ray leaves the ball."""
    level: NDArray[np.int64]
    """(N,) level that a ray is traced at next, 0 where it is done."""
    steps: NDArray[np.int64]
    """(N,) steps that were made."""
    hit: NDArray[np.bool_]
    """(N,) whether the ray has met the surface."""
    evaluations: list[int]
    """How often each level's network was evaluated, at index level - 1."""
    before: NDArray[np.float64]
    """(N, 2) where the last free sphere is, as the distance from the origin, and its radius; 0: there is none."""
    looks: int = 0
    """How often the gradient was evaluated for rays that went on."""
    traced: list[list[int]] = field(default_factory=list)
    """How many rays were traced in each phase of each round, [round][level - 1]; of the plain schedule."""
    evaluations_outside: int = 0
    """How often level 1's network was evaluated for rays that were traced at level 1; of the plain schedule."""

    def advance(
        self,
        indices: NDArray[np.intp],
        f: Array,
        widths: NDArray[np.float64],
        reached: NDArray[np.int64],
        settings: TraceSettings,
    ) -> None:
        """Move some rays by one plain step: into the band of the level that they are traced at, or along.

        indices: (M,) of the rays; f: (M,) value of the field where they are; reached: (M,) the level of which f is;
        widths: (M,) half widths of its band there.
        """
        self.steps[indices] += 1
        entered = (reached == self.level[indices]) & (reached < settings.level) & (np.abs(f) < widths)
        self.level[indices[entered]] += 1
        indices, f, widths, reached = indices[~entered], f[~entered], widths[~entered], reached[~entered]
        self._move(indices, settings.free_radius(f, widths, reached), f, reached, settings)

    def stride(
        self,
        indices: NDArray[np.intp],
        f: Array,
        widths: NDArray[np.float64],
        reached: NDArray[np.int64],
        settings: TraceSettings,
    ) -> None:
        """Move some rays by one relaxed step; takes what `advance` takes."""
        self.steps[indices] += 1
        pixel, radius = settings.footprint * self.t[indices], settings.free_radius(f, widths, reached)
        at, free = self.before[indices].T
        moved = self.t[indices] - at
        known = (free > 0) & (moved > 0)
        gap = np.minimum(pixel, GAP)
        apart = known & (radius > 0) & (moved > free + radius + gap) & (moved > 1.00001 * free)
        back = indices[apart]
        self.t[back], self.hit[back], self.level[back], self.before[back, 1] = at[apart] + free[apart], False, 1, 0
        slope = np.where(known, (free - radius) / np.where(known, moved, 1), 1)
        nearest = np.maximum(slope, 0)
        ahead = np.minimum(0.9 * (2 * radius / (1 + nearest) + gap), radius / np.maximum(nearest, 0.5))
        past = known & (radius < 0)
        change = np.where(known & (radius > 0) & (radius < settings.near * gap), np.maximum(ahead, radius), radius)
        change[past] = radius[past] / np.minimum(slope[past], STEEPEST)
        kept = ~past & ~apart
        self.before[indices[kept]] = np.stack([self.t[indices[kept]], radius[kept]], axis=1)
        self._move(indices[~apart], change[~apart], f[~apart], reached[~apart], settings)

    def look(
        self,
        indices: NDArray[np.intp],
        f: Array,
        widths: NDArray[np.float64],
        reached: NDArray[np.int64],
        slope: NDArray[np.float64],
        settings: TraceSettings,
    ) -> None:
        """Move rays by their first relaxed step, Newton's where it leads to the surface (glsl/normals.glsl).

        slope: (M,) of f along the rays, positive where it falls; the others as `advance` takes them.
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
        indices: NDArray[np.intp],
        change: NDArray[np.float64],
        f: Array,
        reached: NDArray[np.int64],
        settings: TraceSettings,
    ) -> None:
        """Move rays by a step (M,), and find out whether they hit there or are done."""
        last, pixel = reached == settings.level, settings.footprint * self.t[indices]
        self.t[indices] += change
        left = (self.t[indices] > self.far[indices]) | (self.t[indices] < 0)
        self.hit[indices] = last & (f < 0.5 * pixel) & ~left
        self.level[indices] = np.where((last & (np.abs(f) < 0.05 * pixel)) | left, 0, reached)


def march(
    program: Program,
    origin: NDArray[np.float64],
    directions: NDArray[np.float64],
    level: int,
    footprint: float,
    rounds: int = 64,
    step_scale: float = 1.0,
    schedule: str = "plain",
    cells: Cells | None = None,
    narrow: Sequence[Grid] = (),
    first_looks: int = 0,
    near: float = NEAR,
    late: bool = False,
) -> Rays:
    """Trace f_level along rays.

    origin: (3,), of all rays; directions: (N, 3) of length 1, model space. footprint: width of a pixel at distance 1.
    rounds: how often the levels are gone through; step_scale: factor on every step, beside each level's own.
    schedule: "plain" or "relaxed". cells: what the relaxed one skips; only where `level` is the last one. narrow: of
    `narrow_widths`, of the first levels. first_looks: so many steps of the relaxed schedule evaluate the gradient, and
    end many rays, as in glsl/normals.glsl. near: NEAR or NEAR_ALONE. late: whether a step of the relaxed schedule comes
    before these looks, as in glsl/traced.glsl.
    """
    bounds = np.array([band.band_step_bound for band in program.bands])
    bounds[level - 1] = program.bands[level - 1].step_bound
    settings = TraceSettings(level, footprint, step_scale * bounds, near)
    t, far, meets = ball(origin, directions, 1.0 + program.bands[level - 1].delta)
    none, never = np.zeros(len(t), np.int64), np.zeros(len(t), np.bool_)
    rays = Rays(t, far, np.where(meets, 1, 0), none, never, [0] * level, np.zeros((len(t), 2)))
    relaxed = schedule == "relaxed"
    looks = np.zeros(len(t), np.int64)
    skipping = None if cells is None else Skipping(cells, origin, directions, footprint, step_scale, looks)

    def points_of(active: NDArray[np.intp]) -> Array:
        return (origin + rays.t[active, None] * directions[active]).astype(np.float32)

    def nested(active: NDArray[np.intp], deepest: int) -> tuple[Array, NDArray[np.float64], NDArray[np.int64]]:
        points = points_of(active)
        widths = half_widths(program, narrow, points)
        f, reached = nested_field(program, points, deepest, margins=margins(program, widths) if narrow else None)
        return f, widths[reached - 1, np.arange(len(points))], reached

    def evaluate(active: NDArray[np.intp], deepest: int) -> tuple[Array, NDArray[np.float64], NDArray[np.int64]]:
        f, widths, reached = nested(active, deepest)
        for i in range(deepest):
            rays.evaluations[i] += int(np.count_nonzero(reached > i))
        return f, widths, reached

    def leave_out_empty_cells() -> None:
        far_out = np.flatnonzero((rays.level == 1) & (rays.t > 0))  # an eye inside the shape is found out first
        if skipping is not None:
            skipping.skip(far_out, rays.t, rays.far, rays.before)
            rays.level[far_out[rays.t[far_out] > rays.far[far_out]]] = 0

    def step() -> None:
        leave_out_empty_cells()
        active = np.flatnonzero(rays.level > 0)
        rays.stride(active, *evaluate(active, level), settings)

    if late:
        step()
        looks[:] = 0
    for _ in range(first_looks):
        leave_out_empty_cells()
        active = np.flatnonzero(rays.level > 0)
        gradients, _ = field_gradient(program, points_of(active), level)
        slope = -(gradients * directions[active]).sum(axis=1)
        rays.look(active, *nested(active, level), slope, settings)  # the gradient's evaluation has the values, too
        rays.looks += int(np.count_nonzero((rays.level > 0)[active]))
        looks[:] = 0
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
