"""The training step of one level: f_i = f_{i-1} + r on the samples of its pools, and the loss of Eq. 4."""

from collections.abc import Callable

import torch
from torch import Tensor

from .networks import losses
from .networks.fit import Step
from .networks.network import Weights, add_derivative, adjoint_pass, initial
from .pools import Pool
from .settings import LossWeights

BATCH = 4096
"""Samples of a step."""
RATE = 20e-3
"""Peak rate of hidden layers of up to `RATE_WIDTH`; a wider layer's, whose sums are longer, is lower in proportion."""
RATE_WIDTH = 64
OUTPUT_FACTOR = 0.1
"""Factor on the output layer's rate: its weights are smaller by omega_0."""
OUTPUT_FACTOR_PER_DELTA = 5.0
"""The same factor for a residual in a narrow band, per half width: what it has to add is smaller, too."""
RESIDUAL = 0.01
"""Factor on a residual's output layer at its start: it begins near zero."""


def start(
    network: tuple[int, int], omega: float, *, first: bool, seed: int, device: torch.device
) -> Callable[[], Weights]:
    """Return a function that makes the level's network as it is before the first step.

    network: (width, depth). omega: omega_0. first: whether it is level 1, not a residual.
    """

    def make() -> Weights:
        generator = torch.Generator().manual_seed(seed)
        weights = initial(network, omega, 1, generator, 1.0 if first else RESIDUAL)
        return [w.to(device) for w in weights]

    return make


def rates(width: int, delta: float | None) -> tuple[float, float]:
    """Choose `Task.rate` and `Task.output_factor` of a level.

    delta: half width of the band that the level is trained in; None for level 1.
    """
    factor = OUTPUT_FACTOR if delta is None else min(OUTPUT_FACTOR, OUTPUT_FACTOR_PER_DELTA * delta)
    return RATE * min(1, RATE_WIDTH / width), factor


def step(surface: Pool, volume: Pool, weight: LossWeights, generator: torch.Generator) -> Step:
    """Make the level's training step: one batch of its loss, half of it on the surface."""
    half = min(BATCH // 2, len(surface.points), len(volume.points))
    surface_batches, volume_batches = surface.batches(half, generator), volume.batches(half, generator)

    def run(weights: Weights) -> float:
        on, around = next(surface_batches), next(volume_batches)
        residual = adjoint_pass(weights, torch.cat((on.points, around.points)))
        f = residual.f + torch.cat((on.frozen, around.frozen))
        gradient = residual.gradient + torch.cat((on.frozen_gradient, around.frozen_gradient))
        loss, d_f, d_gradient = level_loss(f, gradient, on, around, weight)
        add_derivative(weights, residual, d_f, d_gradient)
        return loss.item()

    return run


def idle_loss(surface: Pool, volume: Pool, weight: LossWeights) -> float:
    """Compute the loss of f_{i-1} alone, which is what a residual that has collapsed to zero is left with."""
    f = torch.cat((surface.frozen, volume.frozen))
    gradient = torch.cat((surface.frozen_gradient, volume.frozen_gradient))
    return level_loss(f, gradient, surface, volume, weight)[0].item()


def level_loss(
    f: Tensor, gradient: Tensor, surface: Pool, volume: Pool, weight: LossWeights
) -> tuple[Tensor, Tensor, Tensor]:
    """Compute the loss of Eq. 4, with exact distances where they are known.

    f: (N,), gradient: (N, 3): of f_i, at the points of `surface`, then of `volume`. Returns the loss, and its
    derivatives with respect to f (N,) and to the gradient (N, 3).
    """
    assert surface.distance is not None
    assert surface.normals is not None
    assert volume.distance is not None
    on = len(surface.points)
    value, d_value = losses.value(f[:on], surface.distance)
    distance, d_distance = losses.value(f[on:], volume.distance)
    normal, d_normal = losses.normal(gradient[:on], surface.normals)
    eikonal, d_eikonal = losses.eikonal(gradient)
    loss = weight.value * value + weight.normal * normal + weight.distance * distance + weight.eikonal * eikonal
    d_gradient = d_eikonal.mul_(weight.eikonal)
    d_gradient[:on].add_(d_normal, alpha=weight.normal)
    return loss, torch.cat((weight.value * d_value, weight.distance * d_distance)), d_gradient
