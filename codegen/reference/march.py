"""Multiscale sphere tracing (Section 3.2, Appendix C) in numpy, step by step as glsl/march.glsl does it.

It counts what a frame costs, and the shaders' steps are compared with its own.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .interpret import nested_field

OFFSET = 1.3
"""The offset surface of a band is traced where |f_i| is delta over this (glsl/march.glsl)."""


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
    deltas: NDArray[np.float64]
    """(L,) half widths of all levels' bands, model units."""
    footprint: float
    """Width of a pixel at distance 1, model units."""
    bounds: NDArray[np.float64]
    """(L,) factors on the steps of all levels, of `level` as the last."""


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
    traced: list[list[int]] = field(default_factory=list)
    """How many rays were traced in each phase of each round, [round][level - 1]."""
    evaluations_outside: int = 0
    """How often level 1's network was evaluated for rays that were traced at level 1, which is outside its band."""

    def step(self, indices: NDArray[np.intp], f: Array, reached: NDArray[np.int64], settings: TraceSettings) -> None:
        """Move some rays by one step: into the band of the level that they are traced at, or along.

        indices: (M,) of the rays; f: (M,) value of the field where they are; reached: (M,) the level of which f is.
        """
        self.steps[indices] += 1
        deltas = settings.deltas
        entered = (reached == self.level[indices]) & (reached < settings.level) & (np.abs(f) < deltas[reached - 1])
        self.level[indices[entered]] += 1
        indices, f, reached = indices[~entered], f[~entered], reached[~entered]
        last, pixel = reached == settings.level, settings.footprint * self.t[indices]
        self.t[indices] += settings.bounds[reached - 1] * np.where(last, f, f - deltas[reached - 1] / OFFSET)
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
) -> Rays:
    """Trace f_level along rays.

    origin: (3,), of all rays; directions: (N, 3) of length 1, model space. footprint: width of a pixel at distance 1.
    rounds: how often the levels are gone through; step_scale: factor on every step, beside each level's own.
    """
    deltas, bounds = np.array([(band.delta, band.band_step_bound) for band in program.bands]).T
    bounds[level - 1] = program.bands[level - 1].step_bound
    settings = TraceSettings(level, deltas, footprint, step_scale * bounds)
    t, far, meets = ball(origin, directions, 1.0 + settings.deltas[level - 1])
    rays = Rays(t, far, np.where(meets, 1, 0), np.zeros(len(t), np.int64), np.zeros(len(t), np.bool_), [0] * level)
    while (rays.level > 0).any() and len(rays.traced) < rounds:
        rays.traced.append([])
        for phase in range(1, level + 1):
            active = np.flatnonzero(rays.level == phase)
            rays.traced[-1].append(len(active))
            for _ in range(program.bands[phase - 1].iterations):
                if not len(active):
                    break
                points = (origin + rays.t[active, None] * directions[active]).astype(np.float32)
                f, reached = nested_field(program, points, phase)
                for i in range(phase):
                    rays.evaluations[i] += int(np.count_nonzero(reached > i))
                rays.evaluations_outside += len(active) if phase == 1 else 0
                rays.step(active, f, reached, settings)
                active = active[rays.level[active] == phase]
    return rays
