"""The rays of all photographs, as tensors to draw batches from."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from .posed import Posed

ON_OBJECT = 0.5
"""Share of the rays of a step that are drawn from the masks' insides alone."""


@dataclass(frozen=True, eq=False)
class Rays:
    """N rays of photographs, and what is seen along them."""

    eyes: Tensor
    """(N, 3), where they begin, model space."""
    directions: Tensor
    """(N, 3), of length 1."""
    near: Tensor
    """(N,), where they enter the unit ball, as a distance from the eye; 0 where the eye is inside it."""
    far: Tensor
    """(N,), where they leave it."""
    colours: Tensor
    """(N, 3), sRGB in [0, 1]."""
    inside: Tensor | None
    """(N,), 1 where the mask has the object, 0 elsewhere; None without masks."""

    def __len__(self) -> int:
        """Count the rays."""
        return len(self.eyes)

    def take(self, index: Tensor | slice) -> "Rays":
        """Return the rays at an index (M,) or a slice."""
        inside = None if self.inside is None else self.inside[index]
        columns = (self.eyes, self.directions, self.near, self.far, self.colours)
        eyes, directions, near, far, colours = (column[index] for column in columns)
        return Rays(eyes, directions, near, far, colours, inside)


def rays_of(views: Sequence[Posed], device: torch.device) -> tuple[Rays, Tensor]:
    """Gather the rays of photographs that pass through the unit ball, in which the object is.

    Returns them, and the index (N,) of the pixel that each is of, counting through all pixels of all views.
    """
    directions = np.concatenate([view.directions().reshape(-1, 3) for view in views])
    counts = [view.mask.size if view.mask is not None else view.size[0] * view.size[1] for view in views]
    eyes = np.concatenate([np.tile(view.eye, (n, 1)) for view, n in zip(views, counts, strict=True)])
    colours = np.concatenate([view.colours.reshape(-1, 3) for view in views]) / 255
    middle = -(eyes * directions).sum(axis=1)
    half = 1 - ((eyes + middle[:, None] * directions) ** 2).sum(axis=1)
    hits = (half > 0) & (middle + np.sqrt(np.maximum(half, 0)) > 0)
    reach = np.sqrt(np.maximum(half, 0))
    masks = [view.mask for view in views if view.mask is not None]
    inside = None if len(masks) < len(views) else np.concatenate([mask.ravel() for mask in masks])

    def tensor(array: NDArray[Any]) -> Tensor:
        return torch.from_numpy(array[hits].astype(np.float32)).to(device)

    rays = Rays(
        eyes=tensor(eyes),
        directions=tensor(directions),
        near=tensor(np.maximum(middle - reach, 0)),
        far=tensor(middle + reach),
        colours=tensor(colours),
        inside=None if inside is None else tensor(inside),
    )
    return rays, torch.from_numpy(np.flatnonzero(hits)).to(device)


class RayBatches:
    """Draws rays at random, half of them where the masks have the object."""

    def __init__(self, rays: Rays, count: int, generator: torch.Generator) -> None:
        """count: of a batch."""
        self._rays, self._count, self._generator = rays, count, generator
        self._object = None if rays.inside is None else torch.nonzero(rays.inside)[:, 0]
        share = 1.0 if self._object is None else len(self._object) / len(rays)
        self.inside = (1 - ON_OBJECT) / (1 - ON_OBJECT + ON_OBJECT / max(share, 1e-6))
        """How often one ray outside the masks is drawn for each time that one inside is."""

    def __next__(self) -> Rays:
        """Draw a batch."""
        inside = 0 if self._object is None else int(ON_OBJECT * self._count)
        index = self._drawn(len(self._rays), self._count - inside)
        if self._object is not None:
            index = torch.cat((index, self._object[self._drawn(len(self._object), inside)]))
        return self._rays.take(index)

    def _drawn(self, most: int, count: int) -> Tensor:
        return torch.randint(most, (count,), generator=self._generator).to(self._rays.eyes.device)
