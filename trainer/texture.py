"""The training step of the texture network g (Section 3.2, normal and texture mapping).

g maps model space to sRGB; it is fitted to the colours on the surface and kept constant along normals in the band.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from .batches import Batches
from .networks import losses
from .networks.network import Weights, add_derivative_along, initial, value_along
from .networks.snapshot import Snapshot, random_state, set_random_state
from .pools import Pool

RATE, OUTPUT_FACTOR = 3e-2, 0.1
"""`Task.rate` and `Task.output_factor` of the texture."""
SMOOTHNESS = 2e-4
"""Weight of the second term of the loss: derivatives of colour are larger than colours, by about omega."""
BATCH = 4096
"""Samples of a step."""
GREY = 0.5
"""Mid-grey, in every channel."""


def start(
    network: tuple[int, int], omega: float, seed: int, device: torch.device, *, moving: bool = False
) -> Callable[[], Weights]:
    """Return a function that makes the texture network as it is before the first step: mid-grey, and some noise.

    network: (width, depth). omega: omega_0. moving: whether it takes time.
    """

    def make() -> Weights:
        weights = initial(network, omega, 3, torch.Generator().manual_seed(seed), moving=moving)
        weights[-1] += GREY
        return [w.to(device) for w in weights]

    return make


class TextureStep:
    """The texture's training step: one batch of colours on the surface and of <grad g, grad f>^2 in the band."""

    def __init__(self, surface: Pool, band: Pool, generator: torch.Generator) -> None:
        half = min(BATCH // 2, len(surface.points), len(band.points))
        self._generator = generator
        self.terms: dict[str, Tensor] = {}
        """The terms of the last batch's loss by name, without their weights."""
        self._surface, self._band = (Batches(pool, half, generator) for pool in (surface, band))

    def __call__(self, weights: Weights) -> float:
        """Add the gradients of one batch to the weights' .grad; return the loss."""
        on, around = next(self._surface), next(self._band)
        assert on.colours is not None
        points = torch.cat((on.points, around.points))
        normals = torch.cat((on.frozen_gradient, around.frozen_gradient))
        normals[:, 3:] = 0  # colours are kept constant along the surface's normal, not in time
        forward = value_along(weights, points, normals)
        loss, d_value, d_along, self.terms = texture_loss(forward.value, forward.along, on.colours)
        add_derivative_along(weights, forward, d_value, d_along)
        return loss.item()

    def snapshot(self) -> Snapshot:
        """Return where in the pools the step is, and the state of its random numbers."""
        state = self._surface.snapshot().inside("surface") | self._band.snapshot().inside("band")
        return state | random_state(self._generator)

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot of a step with the same pools. Raises UserError."""
        self._surface.restore(snapshot.of("surface"))
        self._band.restore(snapshot.of("band"))
        set_random_state(self._generator, snapshot)


def texture_loss(colours: Tensor, along: Tensor, truth: Tensor) -> tuple[Tensor, Tensor, Tensor, dict[str, Tensor]]:
    """Compute T(phi) of Section 3.2.

    colours: (N, 3), values of g, and along: (N, 3), <grad g, grad f>, at points of the surface, whose colours are
    truth: (M, 3), then at points of the band. Returns the loss, its derivatives with respect to colours and along, and
    its terms by name.
    """
    on = len(truth)
    colour, d_colour = losses.color(colours[:on], truth)
    smooth, d_along = losses.constant_along_normals(along)
    d_value = torch.zeros_like(colours)
    d_value[:on] = d_colour
    return colour + SMOOTHNESS * smooth, d_value, d_along.mul_(SMOOTHNESS), {"colour": colour, "along": smooth}


def idle_loss(surface: Pool) -> float:
    """Compute the loss of mid-grey, which is what a texture that has collapsed is left with."""
    assert surface.colours is not None
    return losses.color(torch.full_like(surface.colours, GREY), surface.colours)[0].item()
