"""What a batch of rays looks like in a scene that is learnt, and how far that is from the photographs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor
from torch.nn import functional

from .bundle import Rays
from .volume import SEEN, opacities, sample, sections, weights_of

Shade = Callable[[Tensor, Tensor, Tensor], Tensor]
"""The indices (M,) of some of the points, the directions in which they are seen and the gradients there, (M, 3) each
-> their colours (M, 3)."""


class Scene(Protocol):
    """A signed distance and a radiance, as networks that are being learnt."""

    def guide(self, points: Tensor) -> Tensor:
        """Evaluate cheaply, without a graph, where about the surface is: points (N, 3) -> (N,)."""

    def evaluate(self, points: Tensor) -> tuple[Tensor, Tensor, Shade]:
        """Evaluate the distance (N,) at points (N, 3), its gradient (N, 3), and what colours them."""

    def sharpness(self) -> Tensor:
        """Return s of the logistic distribution (NeuS), per model unit: how thin the surface is."""

    def backward(self, loss: Tensor) -> None:
        """Add the derivatives of a loss on what was evaluated last to the parameters' .grad."""


@dataclass(frozen=True)
class Effort:
    """How finely rays are sampled."""

    even: int = 16
    """Samples that are spread evenly over a ray."""
    more: int = 24
    """Samples that are added around the surface."""
    rounds: int = 2
    """In how many rounds these are added."""
    sharpest: float = 128.0
    """s of the last of these rounds."""


@dataclass(frozen=True)
class Factors:
    """Weights of the terms of the loss."""

    eikonal: float = 0.1
    mask: float = 1.0
    """NeuS has 0.1. But a pixel that the object covers by half is the darker for it, so that colours draw a bright
    object over its outline; the masks have to outweigh that."""
    inside: float = 1.0
    """Of a ray inside the mask, in its cross entropy, where one outside has 1 (`RayBatches.inside`)."""


@dataclass(frozen=True, eq=False)
class Rendered:
    """R rays with S samples each."""

    colours: Tensor
    """(R, 3), of the surface alone: nothing is added for what is behind it."""
    opacity: Tensor
    """(R,), from 0 to 1."""
    gradient: Tensor
    """(R * S, 3), of the distance at the samples."""


def render(
    scene: Scene, rays: Rays, effort: Effort, generator: torch.Generator | None = None, anneal: float = 1.0
) -> Rendered:
    """Render rays by NeuS's volume rendering. generator: of random shifts; None: none. anneal: as of `opacities`."""
    depths = sample(rays, scene.guide, (effort.even, effort.more), effort.rounds, effort.sharpest, generator)
    cut = sections(rays, depths)
    points = cut.points.reshape(-1, 3)
    f, gradient, shade = scene.evaluate(points)
    shape = depths.shape
    alpha = opacities(
        f.reshape(shape), gradient.reshape(*shape, 3), rays.directions, cut.lengths, scene.sharpness(), anneal
    )
    weights = weights_of(alpha)
    seen = torch.nonzero(weights.detach().flatten() > SEEN)[:, 0]
    colours = torch.zeros_like(points)
    if len(seen):
        shaded = shade(seen, rays.directions[seen // shape[1]], gradient[seen])
        colours = colours.index_put((seen,), shaded)
    summed = (weights[..., None] * colours.reshape(*shape, 3)).sum(dim=1)
    return Rendered(summed, weights.sum(dim=1), gradient)


def loss_of(rendered: Rendered, rays: Rays, factors: Factors, background: float) -> Tensor:
    """Compute NeuS's loss: |colour difference|, the Eikonal term, and, where there are masks, their cross entropy.

    background: grey behind the object where there are no masks, sRGB. With masks, the colours of the object's pixels
    alone count.
    """
    eikonal: Tensor = (torch.linalg.vector_norm(rendered.gradient, dim=1) - 1).square().mean()
    if rays.inside is None:
        behind = background * (1 - rendered.opacity[:, None])
        unmasked = (rendered.colours + behind - rays.colours).abs().sum(dim=1).mean()
        return unmasked + factors.eikonal * eikonal
    inside = rays.inside
    difference = (rendered.colours - rays.colours).abs().sum(dim=1)
    colour = (difference * inside).sum() / (inside.sum() + 1e-5)
    weight = torch.where(inside > 0.5, factors.inside, 1.0)
    entropy = functional.binary_cross_entropy(rendered.opacity.clamp(1e-3, 1 - 1e-3), inside, weight, reduction="sum")
    loss: Tensor = colour + factors.eikonal * eikonal + factors.mask * entropy / weight.sum()
    return loss
