"""A contender: a multiresolution hash grid with a small MLP, written from the paper of Mueller et al. (2022)."""

import time

import numpy as np
import torch
from torch import Tensor, nn

from contenders import BATCH, Trained
from mplicits.mesher.surface import Array
from mplicits.trainer.shapes.shape import Doubles, Shape

FEATURES, TABLE, COARSEST, FINEST = 2, 1 << 15, 16, 512
"""Features of an entry, entries of a table, cells along a side of the first level and of the sixteenth."""
PRIMES = (1, 2_654_435_761, 805_459_861)
"""Factors of the coordinates in the hash."""
WIDTH, RATE, POOL = 64, 1e-2, 400_000
"""Width of the MLP, rate of Adam, number of training samples."""
NEAR = 0.02
"""Standard deviation of the samples near the surface from it, along each axis."""
STEP = 2e-3
"""Length of the steps that the slope of the field is measured with."""


class HashGrid(nn.Module):
    """The network: it gives the signed distance (N,) at points (N, 3) of [-1, 1]^3."""

    def __init__(self, levels: int, generator: torch.Generator) -> None:
        """levels: of the grid, 16 at most."""
        super().__init__()
        growth = (FINEST / COARSEST) ** (1 / 15)
        self.sides = [int(COARSEST * growth**i) for i in range(levels)]
        sizes = [min((side + 1) ** 3, TABLE) for side in self.sides]
        self.tables = nn.ParameterList(
            nn.Parameter((torch.rand(size, FEATURES, generator=generator) * 2 - 1) * 1e-4) for size in sizes
        )
        self.head = nn.Sequential(
            nn.Linear(levels * FEATURES, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, 1)
        )
        self.corners = torch.tensor([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])

    def forward(self, points: Tensor) -> Tensor:
        """Evaluate the network at points (N, 3). Returns (N,)."""
        unit = (points.clamp(-1, 1) + 1) / 2
        features = []
        for side, table in zip(self.sides, self.tables, strict=True):
            scaled = unit * side
            lowest = scaled.floor().clamp(max=side - 1)
            part = (scaled - lowest)[:, None]
            corners = lowest.long()[:, None] + self.corners
            if len(table) < TABLE:
                index = (corners[..., 0] * (side + 1) + corners[..., 1]) * (side + 1) + corners[..., 2]
            else:
                mixed = corners * torch.tensor(PRIMES)
                index = (mixed[..., 0] ^ mixed[..., 1] ^ mixed[..., 2]) % TABLE
            weight = torch.where(self.corners == 1, part, 1 - part).prod(dim=2)
            features.append((weight[..., None] * table[index]).sum(dim=1))
        return self.head(torch.cat(features, dim=1))[:, 0]  # type: ignore[no-any-return]


class HashField:
    """A trained grid as a field of the mesher.

    The clearance relies on a slope that all but one in a thousand difference quotients stay below.
    """

    chunk = 16_384

    def __init__(self, grid: HashGrid, points: Tensor) -> None:
        """points: (N, 3), at which the slope is measured."""
        self._grid = grid
        step = torch.randn(points.shape, generator=torch.Generator().manual_seed(0))
        step = STEP * step / torch.linalg.vector_norm(step, dim=1, keepdim=True)
        with torch.no_grad():
            quotient = (grid(points + step) - grid(points)).abs() / STEP
        self._slope = float(quotient.quantile(0.999))

    def value(self, points: Array) -> Array:
        """Evaluate the signed distance at points (N, 3) float32. Returns (N,)."""
        with torch.no_grad():
            return np.asarray(self._grid(torch.from_numpy(points)).numpy(), np.float32)

    def clearance(self, points: Array) -> Array:
        """Bound the distance from points (N, 3) to the surface from below. Returns (N,)."""
        return np.asarray(np.abs(self.value(points)) / self._slope, np.float32)


def hash_grid(shape: Shape, levels: int, seconds: float, seed: int) -> Trained:
    """Train a grid on distances: half of the samples on the surface, three eighths near it, the rest in the domain."""
    began = time.perf_counter()
    rng, generator = np.random.default_rng(seed), torch.Generator().manual_seed(seed)
    torch.manual_seed(seed)
    grid = HashGrid(levels, generator)
    surface = shape.surface(POOL * 7 // 8, rng).points
    surface[POOL // 2 :] += rng.normal(0, NEAR, (len(surface) - POOL // 2, 3))
    points: Doubles = np.concatenate((surface, rng.uniform(-1, 1, (POOL - len(surface), 3))))
    known = np.concatenate((np.zeros(POOL // 2), shape.distance(points[POOL // 2 :])))
    said = np.isfinite(known)  # a cloud knows no distance in its holes
    positions, distances = (torch.from_numpy(array[said].astype(np.float32)) for array in (points, known))
    optimizer = torch.optim.Adam(grid.parameters(), RATE, eps=1e-15)
    steps, share = 0, 0.0
    while share < 1:
        batch = torch.from_numpy(rng.integers(len(positions), size=BATCH))
        f, distance = grid(positions[batch]), distances[batch]
        loss = ((f - distance).abs() / (distance.abs() + 0.01)).mean()
        optimizer.zero_grad()
        loss.backward()
        for group in optimizer.param_groups:
            group["lr"] = RATE * max(0.01, (1 - share)) if share > 0.5 else RATE
        optimizer.step()
        steps += 1
        share = (time.perf_counter() - began) / seconds
    field = HashField(grid, positions[::4])
    parameters = sum(parameter.numel() for parameter in grid.parameters())
    return Trained(f"hash grid, {levels} levels", parameters, time.perf_counter() - began, (steps,), lambda _: field)
