"""The trained levels f_1, ..., f_{i-1}, which stay fixed while level i is trained."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from .config import SamplingConfig
from .networks import nested
from .networks.network import Weights
from .shapes.shape import Doubles


@dataclass(frozen=True, eq=False)
class FrozenLevels:
    """The frozen levels, coarse to fine, evaluated at NumPy points; there are none while level 1 is trained."""

    levels: Sequence[Weights]
    deltas: Sequence[float]
    """The half-widths delta of their bands."""
    device: torch.device
    """Device of the evaluation."""
    config: SamplingConfig = SamplingConfig()

    @property
    def delta(self) -> float:
        """Half-width delta of the band in which level i is trained; for level 1, the half-width of its shell."""
        return self.deltas[-1] if self.deltas else self.config.first_band

    def field(self, points: Doubles, *more: Weights) -> Doubles:
        """Evaluate the sum of the frozen levels and of the networks `more` at points (N, 3). Returns (N,)."""
        return np.asarray(nested.field([*self.levels, *more], self.tensor(points)).cpu(), np.float64)

    def in_band(self, points: Doubles) -> NDArray[np.bool_]:
        """Return a mask (N,) of the points (N, 3) at which level i is defined (Eq. 3)."""
        return np.asarray(nested.in_band(self.levels, self.deltas, self.tensor(points)).cpu())

    def in_first_band(self, points: Doubles) -> NDArray[np.bool_]:
        """Return a mask (N,) of the points (N, 3) in the band of level 1."""
        return np.asarray(nested.in_band(self.levels[:1], self.deltas[:1], self.tensor(points)).cpu())

    def clip(self, distance: Doubles) -> Doubles:
        """Clip signed distances (N,) to the largest that a residual learns."""
        most = self.config.largest_distance * self.delta
        return np.clip(distance, -most, most)

    def tensor(self, array: Doubles) -> Tensor:
        """Convert to a float32 tensor on the device."""
        return torch.from_numpy(array.astype(np.float32)).to(self.device)
