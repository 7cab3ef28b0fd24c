"""The rays of all photographs as tensors, and batches of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from .photographs import Photograph

ON_OBJECT = 0.5  # share of a batch's rays that are drawn inside the masks only


@dataclass(frozen=True, eq=False)
class Rays:
    """N rays of photographs with their colors."""

    eyes: Tensor
    """(N, 3), origins, model space."""
    directions: Tensor
    """(N, 3), unit vectors."""
    near: Tensor
    """(N,), distance from the eye at which a ray enters the unit ball; 0 if the eye is inside."""
    far: Tensor
    """(N,), distance at which it leaves the ball."""
    colors: Tensor
    """(N, 3), sRGB in [0, 1]."""
    inside: Tensor | None
    """(N,), 1 inside the mask, 0 outside; None without masks."""

    def __len__(self) -> int:
        """Return N."""
        return len(self.eyes)

    def take(self, index: Tensor | slice) -> "Rays":
        """Select rays by index (M,) or slice."""
        inside = None if self.inside is None else self.inside[index]
        return Rays(
            self.eyes[index], self.directions[index], self.near[index], self.far[index], self.colors[index], inside
        )


def rays_of(views: Sequence[Photograph], device: torch.device) -> tuple[Rays, Tensor]:
    """Collect the rays of photographs that meet the unit ball.

    Returns the rays, and the index (N,) of each ray's pixel among all pixels of all views.
    """
    directions = np.concatenate([view.directions().reshape(-1, 3) for view in views])
    eyes = np.concatenate([np.tile(view.eye, (view.size[0] * view.size[1], 1)) for view in views])
    colors = np.concatenate([view.colors.reshape(-1, 3) for view in views]) / 255
    middle = -(eyes * directions).sum(axis=1)
    half = 1 - ((eyes + middle[:, None] * directions) ** 2).sum(axis=1)
    reach = np.sqrt(np.maximum(half, 0))
    hits = (half > 0) & (middle + reach > 0)
    masks = [view.mask for view in views if view.mask is not None]
    inside = None if len(masks) < len(views) else np.concatenate([mask.ravel() for mask in masks])

    def tensor(array: NDArray[Any]) -> Tensor:
        return torch.from_numpy(array[hits].astype(np.float32)).to(device)

    rays = Rays(
        eyes=tensor(eyes),
        directions=tensor(directions),
        near=tensor(np.maximum(middle - reach, 0)),
        far=tensor(middle + reach),
        colors=tensor(colors),
        inside=None if inside is None else tensor(inside),
    )
    return rays, torch.from_numpy(np.flatnonzero(hits)).to(device)


class RayBatches:
    """Draws batches of random rays, half of them inside the masks."""

    def __init__(self, rays: Rays, count: int, generator: torch.Generator) -> None:
        """count: rays of a batch."""
        self._rays, self._count, self._generator = rays, count, generator
        self._object = None if rays.inside is None else torch.nonzero(rays.inside)[:, 0]
        share = 1.0 if self._object is None else len(self._object) / len(rays)
        self.inside = (1 - ON_OBJECT) / (1 - ON_OBJECT + ON_OBJECT / max(share, 1e-6))
        """Probability of a ray outside the masks, divided by that of a ray inside."""

    def __next__(self) -> Rays:
        """Draw a batch."""
        inside = 0 if self._object is None else int(ON_OBJECT * self._count)
        index = self._random(len(self._rays), self._count - inside)
        if self._object is not None:
            index = torch.cat((index, self._object[self._random(len(self._object), inside)]))
        return self._rays.take(index)

    def _random(self, most: int, count: int) -> Tensor:
        return torch.randint(most, (count,), generator=self._generator).to(self._rays.eyes.device)
