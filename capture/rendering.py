"""Renders a batch of rays, and compares it with the photographs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor
from torch.nn import functional

from .rays import Rays
from .volume import SEEN, opacities, sample, sections, weights_of

Shade = Callable[[Tensor, Tensor, Tensor], Tensor]
"""Indices (M,) of points, view directions (M, 3) and gradients (M, 3) -> colors (M, 3)."""


class Scene(Protocol):
    """A trainable signed distance and radiance."""

    def guide(self, points: Tensor) -> Tensor:
        """Evaluate an inexpensive approximation of the distance (N,) at points (N, 3), without a graph."""

    def evaluate(self, points: Tensor) -> tuple[Tensor, Tensor, Shade]:
        """Evaluate the distance (N,) at points (N, 3), its gradient (N, 3), and their shading function."""

    def sharpness(self) -> Tensor:
        """Return s of the logistic distribution (NeuS), per model unit: the inverse width of the surface."""

    def backward(self, loss: Tensor) -> None:
        """Add the derivatives of a loss on the last evaluation to the parameters' .grad."""


@dataclass(frozen=True)
class Effort:
    """The number of samples of a ray."""

    even: int = 16
    """Samples spread evenly."""
    more: int = 24
    """Samples added near the surface."""
    rounds: int = 2
    """Rounds that add them."""
    sharpest: float = 128.0
    """s of the last round."""


@dataclass(frozen=True)
class Factors:
    """Weights of the terms of the loss."""

    eikonal: float = 0.1
    mask: float = 1.0
    """NeuS has 0.1. But a pixel that the object half covers is darker, so that colors pull a bright object over its
    outline; the masks have to outweigh that."""
    inside: float = 1.0
    """Weight of a ray inside the mask in the cross entropy; a ray outside has 1 (`RayBatches.inside`)."""


@dataclass(frozen=True, eq=False)
class Rendered:
    """R rendered rays with S samples each."""

    colors: Tensor
    """(R, 3), without the background."""
    opacity: Tensor
    """(R,), in [0, 1]."""
    gradient: Tensor
    """(R * S, 3), of the distance at the samples."""


def render(
    scene: Scene, rays: Rays, effort: Effort, generator: torch.Generator | None = None, anneal: float = 1.0
) -> Rendered:
    """Render rays by NeuS's volume rendering. generator: of `sample`. anneal: of `opacities`."""
    depths = sample(rays, scene.guide, (effort.even, effort.more), effort.rounds, effort.sharpest, generator)
    centers, lengths = sections(rays, depths)
    points = centers.reshape(-1, 3)
    f, gradient, shade = scene.evaluate(points)
    shape = depths.shape
    alpha = opacities(
        f.reshape(shape), gradient.reshape(*shape, 3), rays.directions, lengths, scene.sharpness(), anneal
    )
    weights = weights_of(alpha)
    seen = torch.nonzero(weights.detach().flatten() > SEEN)[:, 0]
    colors = torch.zeros_like(points)
    if len(seen):
        colors = colors.index_put((seen,), shade(seen, rays.directions[seen // shape[1]], gradient[seen]))
    summed = (weights[..., None] * colors.reshape(*shape, 3)).sum(dim=1)
    return Rendered(summed, weights.sum(dim=1), gradient)


def loss_of(rendered: Rendered, rays: Rays, factors: Factors, background: float) -> Tensor:
    """Compute NeuS's loss: color difference, Eikonal term, and with masks their cross entropy.

    background: gray behind the object, sRGB, used without masks. With masks, only colors inside them count.
    """
    eikonal: Tensor = (torch.linalg.vector_norm(rendered.gradient, dim=1) - 1).square().mean()
    if rays.inside is None:
        behind = background * (1 - rendered.opacity[:, None])
        unmasked = (rendered.colors + behind - rays.colors).abs().sum(dim=1).mean()
        return unmasked + factors.eikonal * eikonal
    inside = rays.inside
    difference = (rendered.colors - rays.colors).abs().sum(dim=1)
    color = (difference * inside).sum() / (inside.sum() + 1e-5)
    weight = torch.where(inside > 0.5, factors.inside, 1.0)
    entropy = functional.binary_cross_entropy(rendered.opacity.clamp(1e-3, 1 - 1e-3), inside, weight, reduction="sum")
    loss: Tensor = color + factors.eikonal * eikonal + factors.mask * entropy / weight.sum()
    return loss
