"""The texture network g (Section 3.2, normal and texture mapping): model space -> sRGB, constant along normals."""

from collections.abc import Callable

import torch
from torch import Tensor

from .networks import losses
from .networks.fit import Step
from .networks.network import Weights, add_derivative_along, initial, value_along
from .pools import Pool

RATE, LAST = 3e-2, 0.1
"""Of the optimiser: see `trainer.fit.Task`."""
SMOOTHNESS = 2e-4
"""Weight of the second term of the loss: derivatives of colour are larger than colours, by about omega."""
BATCH = 4096


def start(network: tuple[int, int], omega: float, seed: int, device: torch.device) -> Callable[[], Weights]:
    """Makes the network (width, depth) at its beginning, mid-grey within its noise."""

    def make() -> Weights:
        weights = initial(network, omega, 3, torch.Generator().manual_seed(seed))
        weights[-1] += 0.5
        return [w.to(device) for w in weights]

    return make


def step(surface: Pool, band: Pool, generator: torch.Generator) -> Step:
    """One batch of the texture loss: colour on the surface, <grad g, grad f>^2 in the band."""
    half = min(BATCH // 2, len(surface.points), len(band.points))
    on, around = surface.batches(half, generator), band.batches(half, generator)

    def run(weights: Weights) -> float:
        here, there = next(on), next(around)
        assert here.colours is not None
        points = torch.cat((here.points, there.points))
        normals = torch.cat((here.frozen_gradient, there.frozen_gradient))
        found = value_along(weights, points, normals)
        loss, d_value, d_along = texture_loss(found.value, found.along, here.colours)
        add_derivative_along(weights, found, d_value, d_along)
        return loss.item()

    return run


def texture_loss(colours: Tensor, along: Tensor, truth: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """T(phi) of Section 3.2 and its derivatives with respect to g and to <grad g, grad f>.

    colours, along: (n, 3) at the surface's points, whose colours are `truth`, then at those of the band.
    """
    on = len(truth)
    colour, d_colour = losses.colour(colours[:on], truth)
    smooth, d_along = losses.constant_along_normals(along)
    d_value = torch.zeros_like(colours)
    d_value[:on] = d_colour
    return colour + SMOOTHNESS * smooth, d_value, d_along.mul_(SMOOTHNESS)


def idle_loss(surface: Pool) -> float:
    """The loss of mid-grey."""
    assert surface.colours is not None
    return losses.colour(torch.full_like(surface.colours, 0.5), surface.colours)[0].item()
