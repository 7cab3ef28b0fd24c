"""Multiscale sphere tracing (Section 3.2, Appendix C) in numpy, as glsl/march.glsl steps it: what a frame's work is."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..ir.program import Array, Program
from .interpret import nested_field

OFFSET = 1.3
"""A band's offset surface is traced at delta over this (glsl/march.glsl)."""


def ball(
    origin: NDArray[np.float64], directions: NDArray[np.float64], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Where rays enter and leave the ball of a radius around 0, and whether they meet it at all: (N,) each.

    origin: (3,), directions: (N, 3) of length 1, model space.
    """
    b = directions @ origin
    discriminant = b * b - origin @ origin + radius * radius
    half = np.sqrt(np.maximum(discriminant, 0))
    return np.maximum(-b - half, 0), half - b, (discriminant > 0) & (half - b > 0)


@dataclass(eq=False)
class Rays:
    """t, far: (N,) where each ray is and where it leaves the ball; at: (N,) the level that it is traced at next, 0 of
    one that is done; steps, hit: (N,).

    traced: how many rays, [round][level - 1]. evaluations: how often each level's network was evaluated; away: how
    often level 1's was for rays that are not in its band.
    """

    t: NDArray[np.float64]
    far: NDArray[np.float64]
    at: NDArray[np.int64]
    steps: NDArray[np.int64]
    hit: NDArray[np.bool_]
    evaluations: list[int]
    traced: list[list[int]] = field(default_factory=list)
    away: int = 0

    def step(self, which: NDArray[np.intp], f: Array, reached: NDArray[np.int64], target: "Target") -> None:
        """One step of some rays, where f is the field's value and `reached` its level: into a band, or along."""
        self.steps[which] += 1
        entered = (reached == self.at[which]) & (reached < target.level) & (np.abs(f) < target.deltas[reached - 1])
        self.at[which[entered]] += 1
        which, f, reached = which[~entered], f[~entered], reached[~entered]
        last, width = reached == target.level, target.pixel * self.t[which]
        self.t[which] += target.step_scale * np.where(last, f, f - target.deltas[reached - 1] / OFFSET)
        left = self.t[which] > self.far[which]
        self.hit[which] = last & (f < 0.5 * width) & ~left
        self.at[which] = np.where((last & (np.abs(f) < 0.05 * width)) | left, 0, reached)


@dataclass(frozen=True, eq=False)
class Target:
    """level: which is traced; deltas: half widths of all bands; pixel: width of a pixel at distance 1."""

    level: int
    deltas: NDArray[np.float64]
    pixel: float
    step_scale: float


def march(
    program: Program,
    origin: NDArray[np.float64],
    directions: NDArray[np.float64],
    level: int,
    pixel: float,
    rounds: int = 32,
    step_scale: float = 0.8,
) -> Rays:
    """Traces f_level. origin: (3,), directions: (N, 3) of length 1, model space; pixel: its width at distance 1."""
    target = Target(level, np.array([band.delta for band in program.bands]), pixel, step_scale)
    t, far, meets = ball(origin, directions, 1.0 + target.deltas[level - 1])
    rays = Rays(t, far, np.where(meets, 1, 0), np.zeros(len(t), np.int64), np.zeros(len(t), np.bool_), [0] * level)
    while (rays.at > 0).any() and len(rays.traced) < rounds:
        rays.traced.append([])
        for phase in range(1, level + 1):
            active = np.flatnonzero(rays.at == phase)
            rays.traced[-1].append(len(active))
            for _ in range(program.bands[phase - 1].iterations):
                if not len(active):
                    break
                points = (origin + rays.t[active, None] * directions[active]).astype(np.float32)
                f, reached = nested_field(program, points, phase)
                for i in range(phase):
                    rays.evaluations[i] += int(np.count_nonzero(reached > i))
                rays.away += len(active) if phase == 1 else 0
                rays.step(active, f, reached, target)
                active = active[rays.at[active] == phase]
    return rays
