"""The levels before the one that is trained, as its samplers ask them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from .networks.nested import field, in_band
from .networks.network import Weights
from .shapes.shape import Doubles

FIRST_BAND = 0.1
"""Half width of the shell around the surface that level 1 sees more of than of the rest of the domain."""

REACH = 4.0
"""Largest distance, in half widths of the band, that a residual is taught; dithering reaches 3.5."""


@dataclass(frozen=True, eq=False)
class Before:
    """The frozen levels; none where level 1 is trained."""

    levels: Sequence[Weights]
    deltas: Sequence[float]
    """The half widths of their bands."""
    device: torch.device
    """Where points are evaluated."""

    @property
    def delta(self) -> float:
        """The half width of the band that the level is trained in; of level 1, that of its shell."""
        return self.deltas[-1] if self.deltas else FIRST_BAND

    def field(self, points: Doubles, *more: Weights) -> Doubles:
        """Return the sum of these levels, and of `more`, at points (N, 3): (N,)."""
        return np.asarray(field([*self.levels, *more], self.tensor(points)).cpu(), np.float64)

    def in_band(self, points: Doubles) -> NDArray[np.bool_]:
        """Tell at which points (N, 3) the level that is trained is defined: (N,)."""
        return np.asarray(in_band(self.levels, self.deltas, self.tensor(points)).cpu())

    def in_first_band(self, points: Doubles) -> NDArray[np.bool_]:
        """Tell which points (N, 3) are in the band of level 1: (N,)."""
        return np.asarray(in_band(self.levels[:1], self.deltas[:1], self.tensor(points)).cpu())

    def taught(self, distance: Doubles) -> Doubles:
        """Cut signed distances (N,) off at `REACH` half widths."""
        return np.clip(distance, -REACH * self.delta, REACH * self.delta)

    def tensor(self, array: Doubles) -> Tensor:
        """Return an array as single precision on the device."""
        return torch.from_numpy(array.astype(np.float32)).to(self.device)
