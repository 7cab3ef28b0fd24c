"""Training samples of one level, with the frozen levels evaluated on them once."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from . import sampling
from .networks.network import Weights, value, value_and_gradient
from .shapes.shape import Doubles, Shape

CHUNK = 8192
FIRST_BAND = 0.1
"""Half width of the shell around the surface that level 1 sees more of than of the rest of the domain."""
STRAY_CANDIDATES = 400_000
"""Points of the domain among which strays are looked for."""
STRAYS = 4096
STRAY_ERROR = 0.5
"""Error from which on a point is a stray, in half widths of the band."""
STRAY_REACH = 4.0
"""Largest distance, in half widths of the band, that a residual is taught; dithering reaches 3.5."""
STRAY_SHARE = 0.15
"""Strays among the points that a residual's volume samples are dithered from."""
OFFSET_SHARE = 0.25
"""Share of a cloud's surface samples moved along their normals. A mesh has exact distances in the band instead."""


@dataclass(frozen=True, eq=False)
class Pool:
    """Samples and f_{i-1} at them; for the first level f_0 = 0.

    points: (n, 3). distance: (n,), NaN where it is not known, or None. normals: (n, 3), or None.
    frozen, frozen_gradient: (n,), (n, 3) of f_{i-1}. colours: (n, 3) sRGB, or None.
    """

    points: Tensor
    distance: Tensor | None
    normals: Tensor | None
    frozen: Tensor
    frozen_gradient: Tensor
    colours: Tensor | None = None

    def batches(self, size: int, generator: torch.Generator) -> Iterator["Pool"]:
        """Endless batches of `size` samples; every sample once before any comes again. `size` is at most n."""
        count = len(self.points)
        while True:
            mixed = self._take(torch.randperm(count, generator=generator).to(self.points.device))
            for start in range(0, count - size + 1, size):
                yield mixed._take(slice(start, start + size))

    def _take(self, index: Tensor | slice) -> "Pool":
        def take(column: Tensor | None) -> Tensor | None:
            return None if column is None else column[index]

        known = take(self.distance), take(self.normals)
        return Pool(self.points[index], *known, self.frozen[index], self.frozen_gradient[index], take(self.colours))


def evaluate(levels: Sequence[Weights], points: Tensor) -> tuple[Tensor, Tensor]:
    """f_i and grad f_i at points (n, 3): the sum of `levels`, without a graph. (n,), (n, 3)"""
    f, gradient = points.new_zeros(len(points)), torch.zeros_like(points)
    with torch.no_grad():
        for k in range(0, len(points), CHUNK):
            for weights in levels:
                part = value_and_gradient(weights, points[k : k + CHUNK])
                f[k : k + CHUNK] += part[0]
                gradient[k : k + CHUNK] += part[1]
    return f, gradient


def values(levels: Sequence[Weights], points: Tensor) -> Tensor:
    """f_i at points (n, 3), without a graph. (n,)"""
    f = points.new_zeros(len(points))
    with torch.no_grad():
        for k in range(0, len(points), CHUNK):
            for weights in levels:
                f[k : k + CHUNK] += value(weights, points[k : k + CHUNK])[:, 0]
    return f


class Sampler:
    """Draws the pools of a level: `frozen` are the levels before it, `deltas` their bands."""

    def __init__(
        self,
        shape: Shape,
        frozen: Sequence[Weights],
        deltas: Sequence[float],
        device: torch.device,
        rng: np.random.Generator,
    ) -> None:
        self._shape, self._frozen, self._deltas, self._device, self._rng = shape, frozen, deltas, device, rng
        self._delta = deltas[-1] if deltas else FIRST_BAND
        self._strays = self._find_strays() if frozen else np.empty((0, 3))

    def surface(self, count: int) -> Pool:
        """Surface samples; of a cloud, a part moved along the normal: f_i(x + t N) = t, grad f_i(x + t N) = N."""
        drawn = self._shape.surface(count, self._rng)
        moved = int(count * OFFSET_SHARE) if self._shape.resolution else 0
        sides = self._rng.choice((-1.0, 1.0), moved)
        directions = drawn.normals[:moved] * sides[:, None]
        t = sampling.offsets(drawn.points[:moved], directions, self._delta, self._shape.clearance)
        t *= self._rng.random(moved)
        points = np.concatenate((drawn.points[:moved] + t[:, None] * directions, drawn.points[moved:]))
        distance = np.concatenate((t * sides, np.zeros(count - moved)))
        return self._pool(points, distance=distance, normals=drawn.normals)

    def volume(self, count: int) -> Pool:
        """Samples of Omega_{i-1}: for level 1 half of the domain, half of a shell; then the band |f_{i-1}| < delta."""
        points = self._volume(count)
        distance = self._shape.distance(points)
        if self._frozen:  # A stray need not learn how far away the surface is, only that it is not here.
            distance = np.clip(distance, -STRAY_REACH * self._delta, STRAY_REACH * self._delta)
        return self._pool(points, distance=np.where(np.abs(distance) < self._shape.resolution, np.nan, distance))

    def coloured(self, count: int) -> Pool:
        """Surface samples with their colours."""
        drawn = self._shape.surface(count, self._rng)
        return self._pool(drawn.points, colours=drawn.colours)

    def band(self, count: int) -> Pool:
        """Samples of level 1's band, which holds every level's surface, for colours that all of them can wear.

        frozen, frozen_gradient: of the finest level that is defined at each sample (Eq. 3).
        """
        delta = self._deltas[0]
        seeds = self._shape.surface(count, self._rng).points
        points = self._tensor(sampling.dithered(seeds, delta, self._in_first_band, count, self._rng))
        f, gradient = evaluate(self._frozen[:1], points)
        inside = torch.ones_like(f, dtype=torch.bool)
        for weights, width in zip(self._frozen[1:], self._deltas, strict=False):
            inside &= f.abs() < width
            part = evaluate([weights], points[inside])
            f[inside] += part[0]
            gradient[inside] += part[1]
        return Pool(points, None, None, f, gradient)

    def _volume(self, count: int) -> Doubles:
        seeds = self._shape.surface(count, self._rng).points
        if self._frozen:
            if len(self._strays):
                seeds = np.concatenate((seeds, self._rng.choice(self._strays, int(count * STRAY_SHARE))))
            return sampling.dithered(seeds, self._delta, self._in_band, count, self._rng)
        far = sampling.domain(count // 2, self._rng)
        near = seeds[len(far) :] + self._rng.uniform(-self._delta, self._delta, (count - len(far), 3))
        return np.concatenate((far, near))

    def _find_strays(self) -> Doubles:
        """Points of the band where the levels before are wrong by half its width or more: new pieces may appear there.

        Dithering around the surface alone sees them rarely (within thin parts) or never (far away). Drawn again by the
        squares of the errors.
        """
        points = sampling.domain(STRAY_CANDIDATES, self._rng)
        points = points[self._in_band(points)]
        f = np.asarray(values(self._frozen, self._tensor(points)).cpu(), np.float64)
        error = np.abs(self._shape.distance(points) - f)
        wrong = error > STRAY_ERROR * self._delta
        points, weight = points[wrong], error[wrong] ** 2
        return self._rng.choice(points, STRAYS, p=weight / weight.sum()) if len(points) else points

    def _in_first_band(self, points: Doubles) -> NDArray[np.bool_]:
        return np.asarray((values(self._frozen[:1], self._tensor(points)).abs() < self._deltas[0]).cpu())

    def _in_band(self, points: Doubles) -> NDArray[np.bool_]:
        """Eq. 3: |f_k| < delta_k for every level k before this one."""
        at = self._tensor(points)
        f, inside = at.new_zeros(len(at)), torch.ones(len(at), dtype=torch.bool, device=at.device)
        for weights, delta in zip(self._frozen, self._deltas, strict=True):
            f += values([weights], at)
            inside &= f.abs() < delta
        return np.asarray(inside.cpu())

    def _tensor(self, array: Doubles) -> Tensor:
        return torch.from_numpy(array.astype(np.float32)).to(self._device)

    def _pool(
        self,
        points: Doubles,
        distance: Doubles | None = None,
        normals: Doubles | None = None,
        colours: Doubles | None = None,
    ) -> Pool:
        positions = self._tensor(points)
        known = [None if a is None else self._tensor(a) for a in (distance, normals, colours)]
        frozen, frozen_gradient = evaluate(self._frozen, positions)
        return Pool(positions, known[0], known[1], frozen, frozen_gradient, known[2])
