"""One level: f_i = f_{i-1} + r on the samples of its pools, and the loss of Eq. 4."""

from collections.abc import Callable

import torch
from torch import Tensor

from .networks import losses
from .networks.fit import Step
from .networks.network import Weights, add_derivative, adjoint_pass, initial
from .pools import Pool
from .settings import LossWeights

BATCH = 4096
RATE = 20e-3
"""Peak rate of hidden layers of up to `RATE_WIDTH`; a wider layer's, whose sums are longer, is lower in proportion."""
RATE_WIDTH = 64
LAST = 0.1
"""Factor on the output layer's rate: its weights are smaller by omega_0."""
LAST_PER_DELTA = 5.0
"""The same for a residual in a narrow band, per half width: what it has to add is smaller, too."""
RESIDUAL = 0.01
"""Factor on a residual's output layer at its start: it begins near zero."""


def start(
    network: tuple[int, int], omega: float, *, first: bool, seed: int, device: torch.device
) -> Callable[[], Weights]:
    """Makes the level's network (width, depth) at its beginning."""

    def make() -> Weights:
        generator = torch.Generator().manual_seed(seed)
        weights = initial(network, omega, 1, generator, 1.0 if first else RESIDUAL)
        return [w.to(device) for w in weights]

    return make


def rates(width: int, delta: float | None) -> tuple[float, float]:
    """`Task.rate` and `Task.last` of a level in the band of half width `delta`; None at level 1."""
    return RATE * min(1, RATE_WIDTH / width), LAST if delta is None else min(LAST, LAST_PER_DELTA * delta)


def step(surface: Pool, volume: Pool, weight: LossWeights, generator: torch.Generator) -> Step:
    """One batch of the level's loss, half of it on the surface."""
    half = min(BATCH // 2, len(surface.points), len(volume.points))
    on, around = surface.batches(half, generator), volume.batches(half, generator)

    def run(weights: Weights) -> float:
        here, there = next(on), next(around)
        found = adjoint_pass(weights, torch.cat((here.points, there.points)))
        f = found.f + torch.cat((here.frozen, there.frozen))
        gradient = found.gradient + torch.cat((here.frozen_gradient, there.frozen_gradient))
        loss, d_f, d_gradient = level_loss(f, gradient, here, there, weight)
        add_derivative(weights, found, d_f, d_gradient)
        return loss.item()

    return run


def idle_loss(surface: Pool, volume: Pool, weight: LossWeights) -> float:
    """The loss of f_{i-1} alone: what a residual that has collapsed to zero is left with."""
    f = torch.cat((surface.frozen, volume.frozen))
    gradient = torch.cat((surface.frozen_gradient, volume.frozen_gradient))
    return level_loss(f, gradient, surface, volume, weight)[0].item()


def level_loss(
    f: Tensor, gradient: Tensor, here: Pool, there: Pool, weight: LossWeights
) -> tuple[Tensor, Tensor, Tensor]:
    """Eq. 4, with the exact distances where they are known, and its derivatives with respect to f and the gradient.

    f, gradient: at the points of `here`, then of `there`.
    """
    assert here.distance is not None
    assert here.normals is not None
    assert there.distance is not None
    on = len(here.points)
    value, d_value = losses.value(f[:on], here.distance)
    distance, d_distance = losses.value(f[on:], there.distance)
    normal, d_normal = losses.normal(gradient[:on], here.normals)
    eikonal, d_eikonal = losses.eikonal(gradient)
    loss = weight.value * value + weight.normal * normal + weight.distance * distance + weight.eikonal * eikonal
    d_gradient = d_eikonal.mul_(weight.eikonal)
    d_gradient[:on].add_(d_normal, alpha=weight.normal)
    return loss, torch.cat((weight.value * d_value, weight.distance * d_distance)), d_gradient
