"""How long the steps of sphere tracing may be, measured along rays: no step may pass through the shape unseen.

A step that ends inside the shape does no harm: the field is negative there, and the next step leads back. What loses a
pixel is a step over a part of the shape that is thinner than the field is wrong. So a step may reach a little into the
first stretch of its ray that is inside, and no farther.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import normalize, pad

from ..model.model import DELTA_FACTOR
from .networks.nested import nested_field, nested_field_and_gradient
from .networks.network import Weights
from .shapes.shape import Doubles

RAYS = 1024
"""Rays that are aimed at points of the surface first, and as many at what is nearest of points in the ball."""
ROUNDS, WORST = 3, 256
"""Rounds in which rays like the worst ones of the round before are followed, and how many for each level."""
ASIDE, TURN = 0.005, 0.05
"""Standard deviations of how far a ray passes from its aim, model units, and of how far it is turned, radians."""
INSIDE = 0.25
"""Share of the first stretch inside that a step may reach: other rays may find the shape thinner there."""
SHARE, SHORTEST, LONGEST = 0.7, 0.001, 0.05
"""Steps along a ray: this share of the distance that the field gives, and no less and no more than this."""
SAMPLES, USUAL = 200, 100
"""Most samples of one ray, and what is expected of them."""
ROWS = 256
"""Points are evaluated in multiples of so many."""
GRADIENTS = 8
"""The gradient is measured at one of so many samples."""
LEAST = 0.5
"""Least bound: a field that would need shorter steps is broken, and its pictures would only take longer."""
DECIMALS = 3
"""Of a bound, which is rounded down."""
SEED = 0x57E9
"""Of the rays."""

Field = Callable[[Tensor], tuple[Tensor, Tensor]]
"""Points (N, 3) -> the finest level's value that is defined there (N,), and its number (N,) int64, from 1 (Eq. 3)."""
Gradient = Callable[[Tensor], Tensor]
"""Points (N, 3) -> the gradient of that level there (N, 3)."""


@dataclass(frozen=True, eq=False)
class Rays:
    """N straight lines."""

    aims: Tensor
    """(N, 3), a point of each, model space; distances along a ray count from there. (N, 4) where the field moves: a ray
    is traced at one time."""
    directions: Tensor
    """As many columns, of length 1, along which time does not change."""

    def at(self, ray: Tensor | NDArray[np.int64], t: Tensor | Doubles) -> Tensor:
        """Return the points (M, 3) at distances t (M,) along the rays with these numbers (M,)."""
        ray, t = (torch.as_tensor(column, device=self.aims.device) for column in (ray, t))
        return self.aims[ray] + t.to(self.aims.dtype)[:, None] * self.directions[ray]


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a field along rays: one ray after another, and each in its own order."""

    ray: NDArray[np.int64]
    """(S,) which ray a sample is of."""
    t: Doubles
    """(S,) how far along it a sample is, model units."""
    f: Doubles
    """(S,) the field there."""
    reached: NDArray[np.int64]
    """(S,) of which level f is, counted from 1."""


@dataclass(frozen=True, eq=False)
class Limits:
    """The longest steps that may be made from samples outside the shape: none of them passes through it."""

    sample: NDArray[np.int64]
    """(M,) index of the sample where a step begins."""
    end: Doubles
    """(M,) where it ends at the latest, as a distance along the ray: a little inside the shape."""
    ratio: Doubles
    """(M,) this step as a share of what sphere tracing would step."""


@dataclass(frozen=True)
class Tracing:
    """What was measured along rays."""

    step_bounds: list[float]
    """For each level the largest factor on a step, at most 1, with which no step passed through the shape.

    They hold where the last of these levels is traced, the others as bands.
    """
    lipschitz: float
    """Largest |grad f| of the last level that was found along the rays, where it is defined."""


def measure(levels: Sequence[Weights], deltas: Sequence[float], points: Tensor) -> Tracing:
    """Measure how the last of the levels can be traced.

    deltas: half widths of the bands of all levels, the last one's included. points: (P, 3) or (P, 4), on the
    shape's surface.
    """
    return trace(
        lambda at: nested_field(levels, deltas, at),
        lambda at: nested_field_and_gradient(levels, deltas, at)[1],
        deltas,
        points,
    )


def evaluations(levels: int) -> int:
    """Estimate how many values of the field of so many levels `measure` takes; a gradient counts as two."""
    rays = 2 * RAYS + ROUNDS * WORST * levels
    return round(rays * USUAL * (1 + 2 / GRADIENTS))


def trace(field: Field, gradient: Gradient, deltas: Sequence[float], points: Tensor) -> Tracing:
    """Measure a nested field along rays, and along more rays that are like the worst of these.

    deltas: as many as the field has levels. points: (P, 3), on the surface.
    """
    generator = torch.Generator().manual_seed(SEED)
    offsets = np.array([*(delta / DELTA_FACTOR for delta in deltas[:-1]), 0.0])
    rays = _first_rays(gradient, points, generator)
    bounds, lipschitz, spread = [1.0] * len(deltas), 0.0, 1.0
    for _ in range(1 + ROUNDS):
        samples = follow(field, offsets, rays, 1.0 + deltas[-1])
        found = limits(samples, offsets)
        worst = []
        for i in range(len(deltas)):
            of_level = np.flatnonzero(samples.reached[found.sample] == i + 1)
            of_level = of_level[np.argsort(found.ratio[of_level], kind="stable")]
            bounds[i] = min([bounds[i], *found.ratio[of_level[:1]].tolist()])
            first_of_ray = np.unique(samples.ray[found.sample[of_level]], return_index=True)[1]
            worst.append(of_level[np.sort(first_of_ray)[:WORST]])
        defined = np.flatnonzero(samples.reached == len(deltas))[::GRADIENTS]
        slopes = torch.linalg.vector_norm(gradient(rays.at(samples.ray[defined], samples.t[defined]))[:, :3], dim=1)
        lipschitz = max([lipschitz, *slopes.tolist()])
        again = np.concatenate(worst)
        ray = samples.ray[found.sample[again]]
        ends = Rays(rays.at(ray, found.end[again]), rays.directions[torch.from_numpy(ray).to(points.device)])
        rays, spread = _varied(ends, spread, generator), spread / 2
    return Tracing([max(LEAST, math.floor(bound * 10**DECIMALS) / 10**DECIMALS) for bound in bounds], lipschitz)


def _first_rays(gradient: Gradient, points: Tensor, generator: torch.Generator) -> Rays:
    """Draw rays past points (P, 3) of the surface in all directions, and rays from points in the ball to the surface.

    The latter go down the gradient: a field that exceeds the distance exceeds it most on the shortest way.
    """
    on = points[torch.randint(len(points), (RAYS,), generator=generator).to(points.device)]
    radii = torch.rand(RAYS, 1, generator=generator).pow(1 / 3).to(points.device)
    within = normalize(_noise(on, generator)) * radii
    within[:, 3:] = on[:, 3:]
    down = -gradient(within)
    down[:, 3:] = 0
    return _varied(Rays(torch.cat((on, within)), normalize(torch.cat((_noise(on, generator), down)))), 1.0, generator)


def _varied(rays: Rays, spread: float, generator: torch.Generator) -> Rays:
    """Return rays that pass some way from their aims and are turned a little, by shares `spread` of ASIDE and TURN."""
    return Rays(
        rays.aims + spread * ASIDE * _noise(rays.aims, generator),
        normalize(rays.directions + spread * TURN * _noise(rays.aims, generator)),
    )


def follow(field: Field, offsets: Doubles, rays: Rays, radius: float) -> Samples:
    """Sample a field along rays through the ball of a radius, closely where it is near zero.

    offsets: (L,), what sphere tracing takes off each level's value, model units.
    """
    device = rays.aims.device
    off = torch.from_numpy(offsets.astype(np.float32)).to(device)
    along = (rays.aims * rays.directions).sum(dim=1)
    discriminant = along.square() - rays.aims[:, :3].square().sum(dim=1) + radius * radius
    half = discriminant.clamp_min(0).sqrt()
    t, far = -along - half, half - along
    ray = torch.nonzero(discriminant > 0)[:, 0]
    parts: list[tuple[Tensor, Tensor, Tensor, Tensor]] = []
    while len(ray) and len(parts) < SAMPLES:
        f, reached = _evaluated(field, rays.at(ray, t[ray]))
        parts.append((ray, t[ray], f, reached))
        t[ray] += (SHARE * (f.abs() - off[reached - 1])).clamp(SHORTEST, LONGEST)
        ray = ray[t[ray] < far[ray]]
    columns = [torch.cat(column).cpu().numpy() for column in zip(*(parts or [(ray, t[:0], t[:0], ray)]), strict=True)]
    order = np.argsort(columns[0], kind="stable")
    return Samples(
        ray=columns[0][order],
        t=columns[1][order].astype(np.float64),
        f=columns[2][order].astype(np.float64),
        reached=columns[3][order],
    )


def _evaluated(field: Field, points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate a field at points (N, 3), with some of them again so that N is a multiple of `ROWS`.

    For every number of rows that a product has, oneDNN makes code of its own, and keeps it: a second and 0.2 GB for the
    rays of one measurement.
    """
    count = len(points)
    again = torch.arange(-(-count // ROWS) * ROWS, device=points.device) % count
    f, reached = field(points[again])
    return f[:count], reached[:count]


def limits(samples: Samples, offsets: Doubles) -> Limits:
    """Find how far a step may reach from each sample outside the shape that has a stretch inside ahead of it.

    offsets: as `follow` takes them. A sample on which sphere tracing would not go forward is left out, and so is one
    whose ray ends inside the shape: nothing can be passed through there.
    """
    inside = samples.f < 0
    turns = np.flatnonzero((samples.ray[1:] == samples.ray[:-1]) & (inside[1:] != inside[:-1]))
    here, there = np.abs(samples.f[turns]), np.abs(samples.f[turns + 1])
    one_level = samples.reached[turns] == samples.reached[turns + 1]
    share = np.where(one_level, here / np.maximum(here + there, 1e-30), 0.5)
    crossing = samples.t[turns] + share * (samples.t[turns + 1] - samples.t[turns])
    # On a ray, crossings lead inside and outside by turns: an entry is followed by its exit, unless the ray ends there.
    entries = np.flatnonzero(inside[turns + 1])
    exits = np.minimum(entries + 1, len(turns) - 1)
    whole = (exits > entries) & (samples.ray[turns[exits]] == samples.ray[turns[entries]])
    entries, exits = entries[whole], exits[whole]
    end = (1 - INSIDE) * crossing[entries] + INSIDE * crossing[exits]
    sample = np.flatnonzero(~inside)
    ahead = np.searchsorted(turns[entries], sample)
    sample, ahead = sample[ahead < len(entries)], ahead[ahead < len(entries)]
    step = samples.f[sample] - offsets[samples.reached[sample] - 1]
    ahead_of_it = (samples.ray[turns[entries[ahead]]] == samples.ray[sample]) & (step > 0)
    sample, ahead, step = sample[ahead_of_it], ahead[ahead_of_it], step[ahead_of_it]
    return Limits(sample, end[ahead], (end[ahead] - samples.t[sample]) / step)


def _noise(like: Tensor, generator: torch.Generator) -> Tensor:
    """Draw normal numbers for the coordinates of points (N, 3) or (N, 4), and 0 for their times."""
    noise = torch.randn(len(like), 3, generator=generator).to(like.device)
    return pad(noise, (0, like.shape[1] - 3))
