"""The training step of the texture network g (Section 3.2, normal and texture mapping).

g maps model space to sRGB; it is fitted to the colors on the surface and kept constant along normals in the band.
"""

import torch
from torch import Tensor

from .config import TextureConfig
from .networks import losses
from .networks.network import Weights, add_derivative_along, initial, value_along
from .networks.replay import Replay
from .networks.snapshot import Snapshot, random_state, set_random_state
from .training_samples import Batches, Pool

GRAY = 0.5
"""Mid-gray, in every channel."""
TERMS = "colour", "along"  # keys of logs, which keep their spelling
"""Names of the loss's terms, in the order of `texture_loss`."""


def initial_texture(
    network: tuple[int, int], omega: float, seed: int, device: torch.device, *, moving: bool = False
) -> Weights:
    """Return the initial texture network: mid-gray, with some noise.

    network: (width, depth). omega: omega_0. moving: the network takes the time, too.
    """
    weights = initial(network, omega, 3, torch.Generator().manual_seed(seed), moving=moving)
    weights[-1] += GRAY
    return [w.to(device) for w in weights]


class TextureStep:
    """The texture's training step: a batch of colors on the surface, and of <grad g, grad f>^2 in the band."""

    def __init__(
        self, surface: Pool, band: Pool, generator: torch.Generator, config: TextureConfig | None = None
    ) -> None:
        """surface: samples with colors. band: samples of level 1's band."""
        config = config or TextureConfig()
        half = min(config.batch // 2, len(surface.points), len(band.points))
        self._generator, self._smoothness, self._replay = generator, config.smoothness, Replay()
        self.terms: dict[str, float] = {}
        """Terms of the last batch's loss by name, without their weights."""
        self._surface, self._band = (Batches(pool, half, generator) for pool in (surface, band))

    def __call__(self, weights: Weights) -> float:
        """Add the gradients of one batch to the weights' .grad; return the loss."""
        on, around = next(self._surface), next(self._band)
        assert on.colors is not None
        points = torch.cat((on.points, around.points))
        normals = torch.cat((on.frozen_gradient, around.frozen_gradient))
        normals[:, 3:] = 0  # Colors are constant along the normal, not in time.
        numbers = self._replay(add_gradients, weights, self._smoothness, points, normals, on.colors)
        loss, *terms = numbers.tolist()
        self.terms = dict(zip(TERMS, terms, strict=True))
        return float(loss)

    def snapshot(self) -> Snapshot:
        """Return the state of batches and random numbers."""
        state = self._surface.snapshot().inside("surface") | self._band.snapshot().inside("band")
        return state | random_state(self._generator)

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from a snapshot of a step with the same pools. Raises UserError where it is damaged."""
        self._surface.restore(snapshot.of("surface"))
        self._band.restore(snapshot.of("band"))
        set_random_state(self._generator, snapshot)


def add_gradients(weights: Weights, smoothness: float, points: Tensor, normals: Tensor, truth: Tensor) -> Tensor:
    """Add the gradients of a batch to the weights' .grad. Returns the loss and its `TERMS` (3,).

    points: (N, 3). normals: (N, 3), grad f there. smoothness, truth: as for `texture_loss`.
    """
    forward = value_along(weights, points, normals)
    loss, d_value, d_along, terms = texture_loss(forward.value, forward.along, truth, smoothness)
    add_derivative_along(weights, forward, d_value, d_along)
    return torch.stack([loss, *(terms[name] for name in TERMS)])


def texture_loss(
    colors: Tensor, along: Tensor, truth: Tensor, smoothness: float
) -> tuple[Tensor, Tensor, Tensor, dict[str, Tensor]]:
    """Compute T(phi) of Section 3.2.

    colors: (N, 3), values of g at points of the surface, then of the band. along: (N, 3), <grad g, grad f> there.
    truth: (M, 3), colors of the surface points. smoothness: weight of the second term. Returns the loss, its
    derivatives with respect to colors and along, and its terms by name.
    """
    on = len(truth)
    color, d_color = losses.color(colors[:on], truth)
    smooth, d_along = losses.constant_along_normals(along)
    d_value = torch.zeros_like(colors)
    d_value[:on] = d_color
    return color + smoothness * smooth, d_value, d_along.mul_(smoothness), {"colour": color, "along": smooth}


def mean_color(surface: Pool) -> Tensor:
    """Return the mean color (3,) of a surface's samples: all that a texture which has collapsed can say."""
    assert surface.colors is not None
    return surface.colors.mean(dim=0)


def idle_loss(surface: Pool) -> float:
    """Compute the loss of the mean color."""
    assert surface.colors is not None
    return losses.color(mean_color(surface).expand_as(surface.colors).clone(), surface.colors)[0].item()
