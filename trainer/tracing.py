"""Longest safe steps of sphere tracing, measured along rays: no step may pass through the shape.

A step that ends inside the shape is harmless: the field is negative there, and the next step goes back. A step over a
thin part of the shape loses a pixel. So a step may reach a little into the first stretch of its ray inside the shape.
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
from .measuring_config import TracingConfig
from .networks.nested import nested_field, nested_field_and_gradient
from .networks.network import Weights
from .shapes.shape import Doubles

ROWS = 256
"""Points are evaluated in multiples of this number."""
DECIMALS = 3
"""Decimals of a bound, which is rounded down."""
SEED = 0x57E9
"""Seed of the rays."""

Field = Callable[[Tensor], tuple[Tensor, Tensor]]
"""Points (N, 3) -> value of the finest level defined there (N,), and its number (N,) int64, from 1 (Eq. 3)."""
Gradient = Callable[[Tensor], Tensor]
"""Points (N, 3) -> the gradient of that level there (N, 3)."""


@dataclass(frozen=True, eq=False)
class Rays:
    """N straight lines."""

    aims: Tensor
    """(N, 3), a point of each ray, model space, from which distances along the ray count. (N, 4) where the field moves:
    each ray has one time."""
    directions: Tensor
    """As many columns, of length 1; the time does not change along a ray."""

    def at(self, ray: Tensor | NDArray[np.int64], t: Tensor | Doubles) -> Tensor:
        """Return the points (M, 3) at distances t (M,) along the rays with these numbers (M,)."""
        ray, t = (torch.as_tensor(column, device=self.aims.device) for column in (ray, t))
        return self.aims[ray] + t.to(self.aims.dtype)[:, None] * self.directions[ray]


@dataclass(frozen=True, eq=False)
class Samples:
    """S samples of a field along rays, sorted by ray and by distance along the ray."""

    ray: NDArray[np.int64]
    """(S,) index of the sample's ray."""
    t: Doubles
    """(S,) distance along the ray, model units."""
    f: Doubles
    """(S,) value of the field."""
    reached: NDArray[np.int64]
    """(S,) level of that value, from 1."""


@dataclass(frozen=True, eq=False)
class Limits:
    """The longest steps from M samples outside the shape that do not pass through it."""

    sample: NDArray[np.int64]
    """(M,) index of the sample where the step begins."""
    end: Doubles
    """(M,) distance along the ray of the latest end of the step, a little inside the shape."""
    ratio: Doubles
    """(M,) ratio of this step to that of sphere tracing."""


@dataclass(frozen=True)
class Tracing:
    """Result of the measurement along rays."""

    step_bounds: list[float]
    """For each level, the largest factor on a step, at most 1, with which no step passed through the shape.

    They hold where the last of these levels is traced, with the others as bands.
    """
    lipschitz: float
    """Largest |grad f| of the last level along the rays, where it is defined."""


def measure(
    levels: Sequence[Weights], deltas: Sequence[float], points: Tensor, config: TracingConfig | None = None
) -> Tracing:
    """Measure the step bounds of the last level.

    deltas: half-widths of all bands, the last one's included. points: (P, 3) or (P, 4), on the shape's surface.
    """
    return trace(
        lambda at: nested_field(levels, deltas, at),
        lambda at: nested_field_and_gradient(levels, deltas, at)[1],
        deltas,
        points,
        config,
    )


def evaluations(levels: int, config: TracingConfig) -> int:
    """Estimate the number of field values that `measure` takes for this many levels; a gradient counts as two."""
    rays = 2 * config.rays + config.rounds * config.worst * levels
    return round(rays * config.expected_samples * (1 + 2 / config.gradient_every))


def trace(
    field: Field, gradient: Gradient, deltas: Sequence[float], points: Tensor, config: TracingConfig | None = None
) -> Tracing:
    """Measure the step bounds of a nested field along rays, and along more rays like the worst of these.

    deltas: one for each level. points: (P, 3), on the surface.
    """
    config = config or TracingConfig()
    generator = torch.Generator().manual_seed(SEED)
    offsets = np.array([*(delta / DELTA_FACTOR for delta in deltas[:-1]), 0.0])
    rays = _first_rays(gradient, points, generator, config)
    bounds, lipschitz, spread = [1.0] * len(deltas), 0.0, 1.0
    for _ in range(1 + config.rounds):
        samples = follow(field, offsets, rays, 1.0 + deltas[-1], config)
        found = limits(samples, offsets, config.inside)
        worst = []
        for i in range(len(deltas)):
            of_level = np.flatnonzero(samples.reached[found.sample] == i + 1)
            of_level = of_level[np.argsort(found.ratio[of_level], kind="stable")]
            bounds[i] = min([bounds[i], *found.ratio[of_level[:1]].tolist()])
            first_of_ray = np.unique(samples.ray[found.sample[of_level]], return_index=True)[1]
            worst.append(of_level[np.sort(first_of_ray)[: config.worst]])
        defined = np.flatnonzero(samples.reached == len(deltas))[:: config.gradient_every]
        slopes = torch.linalg.vector_norm(gradient(rays.at(samples.ray[defined], samples.t[defined]))[:, :3], dim=1)
        lipschitz = max([lipschitz, *slopes.tolist()])
        again = np.concatenate(worst)
        ray = samples.ray[found.sample[again]]
        ends = Rays(rays.at(ray, found.end[again]), rays.directions[torch.from_numpy(ray).to(points.device)])
        rays, spread = _varied(ends, spread, generator, config), spread / 2
    least = config.least_bound
    return Tracing([max(least, math.floor(bound * 10**DECIMALS) / 10**DECIMALS) for bound in bounds], lipschitz)


def _first_rays(gradient: Gradient, points: Tensor, generator: torch.Generator, config: TracingConfig) -> Rays:
    """Draw rays past points (P, 3) of the surface in all directions, and rays from points in the ball to the surface.

    The latter follow the gradient down: a field that exceeds the distance exceeds it most on the shortest path.
    """
    count = config.rays
    on = points[torch.randint(len(points), (count,), generator=generator).to(points.device)]
    radii = torch.rand(count, 1, generator=generator).pow(1 / 3).to(points.device)
    within = normalize(_noise(on, generator)) * radii
    within[:, 3:] = on[:, 3:]
    down = -gradient(within)
    down[:, 3:] = 0
    directions = normalize(torch.cat((_noise(on, generator), down)))
    return _varied(Rays(torch.cat((on, within)), directions), 1.0, generator, config)


def _varied(rays: Rays, spread: float, generator: torch.Generator, config: TracingConfig) -> Rays:
    """Shift and turn rays a little. spread: factor on the shift `config.aside` and on the turn `config.turn`."""
    return Rays(
        rays.aims + spread * config.aside * _noise(rays.aims, generator),
        normalize(rays.directions + spread * config.turn * _noise(rays.aims, generator)),
    )


def follow(field: Field, offsets: Doubles, rays: Rays, radius: float, config: TracingConfig | None = None) -> Samples:
    """Sample a field along rays through the ball of a radius, densely where it is near zero.

    offsets: (L,), subtracted from each level's value by sphere tracing, model units.
    """
    config = config or TracingConfig()
    device = rays.aims.device
    off = torch.from_numpy(offsets.astype(np.float32)).to(device)
    along = (rays.aims * rays.directions).sum(dim=1)
    discriminant = along.square() - rays.aims[:, :3].square().sum(dim=1) + radius * radius
    half = discriminant.clamp_min(0).sqrt()
    t, far = -along - half, half - along
    ray = torch.nonzero(discriminant > 0)[:, 0]
    parts: list[tuple[Tensor, Tensor, Tensor, Tensor]] = []
    while len(ray) and len(parts) < config.samples:
        f, reached = _evaluated(field, rays.at(ray, t[ray]))
        parts.append((ray, t[ray], f, reached))
        t[ray] += (config.step_share * (f.abs() - off[reached - 1])).clamp(config.shortest, config.longest)
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
    """Evaluate a field at points (N, 3), padded with repeated points to a multiple of `ROWS`.

    oneDNN compiles and keeps code for every number of rows: a second and 0.2 GB for one measurement without this.
    """
    count = len(points)
    again = torch.arange(-(-count // ROWS) * ROWS, device=points.device) % count
    f, reached = field(points[again])
    return f[:count], reached[:count]


def limits(samples: Samples, offsets: Doubles, inside_share: float = TracingConfig.inside) -> Limits:
    """Find the longest step from each sample outside the shape whose ray enters the shape and leaves it again.

    offsets: as in `follow`. inside_share: share of the stretch inside that a step may reach. Samples from which sphere
    tracing would not move forward are left out.
    """
    inside = samples.f < 0
    turns = np.flatnonzero((samples.ray[1:] == samples.ray[:-1]) & (inside[1:] != inside[:-1]))
    here, there = np.abs(samples.f[turns]), np.abs(samples.f[turns + 1])
    one_level = samples.reached[turns] == samples.reached[turns + 1]
    share = np.where(one_level, here / np.maximum(here + there, 1e-30), 0.5)
    crossing = samples.t[turns] + share * (samples.t[turns + 1] - samples.t[turns])
    # Entries and exits alternate along a ray; the last entry may lack an exit.
    entries = np.flatnonzero(inside[turns + 1])
    exits = np.minimum(entries + 1, len(turns) - 1)
    whole = (exits > entries) & (samples.ray[turns[exits]] == samples.ray[turns[entries]])
    entries, exits = entries[whole], exits[whole]
    end = (1 - inside_share) * crossing[entries] + inside_share * crossing[exits]
    sample = np.flatnonzero(~inside)
    ahead = np.searchsorted(turns[entries], sample)
    sample, ahead = sample[ahead < len(entries)], ahead[ahead < len(entries)]
    step = samples.f[sample] - offsets[samples.reached[sample] - 1]
    ahead_of_it = (samples.ray[turns[entries[ahead]]] == samples.ray[sample]) & (step > 0)
    sample, ahead, step = sample[ahead_of_it], ahead[ahead_of_it], step[ahead_of_it]
    return Limits(sample, end[ahead], (end[ahead] - samples.t[sample]) / step)


def _noise(like: Tensor, generator: torch.Generator) -> Tensor:
    """Draw normal random numbers for the coordinates of points (N, 3) or (N, 4), and 0 for their times."""
    noise = torch.randn(len(like), 3, generator=generator).to(like.device)
    return pad(noise, (0, like.shape[1] - 3))
