"""How good a trained sum of levels is, measured on surface points that training never saw."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from .bands import delta
from .networks.network import Weights
from .pools import evaluate, values
from .shapes.shape import Doubles, Shape

POINTS = 100_000
BAND_POINTS = 200_000
LIPSCHITZ_POINTS = 100_000
SEED = 0x5EED


@dataclass(frozen=True)
class Quality:
    """mean_f: mean |f_i|, model units; angle: mean angle between grad f_i and the normal, degrees."""

    mean_f: float
    angle: float


class Probe:
    """Surface points to measure on, drawn once: `held_out` that training never sees, `everywhere` for Eq. 5."""

    def __init__(self, shape: Shape, device: torch.device) -> None:
        rng = np.random.default_rng(SEED)
        drawn = shape.surface(POINTS, rng, held_out=True)
        self.held_out, self._normals = (_tensor(array, device) for array in (drawn.points, drawn.normals))
        more = shape.surface(BAND_POINTS, rng).points
        self.everywhere = torch.cat((self.held_out, _tensor(np.concatenate((shape.inputs(), more)), device)))

    def measure(self, levels: Sequence[Weights]) -> list[Quality]:
        """Quality of f_1, f_2, ..., one for each level."""
        f, gradient = self.held_out.new_zeros(len(self.held_out)), torch.zeros_like(self.held_out)
        found = []
        for weights in levels:
            part = evaluate([weights], self.held_out)
            f, gradient = f + part[0], gradient + part[1]
            cosine = torch.nn.functional.cosine_similarity(gradient, self._normals, dim=1).clamp(-1, 1)
            found.append(Quality(float(f.abs().mean()), float(torch.rad2deg(torch.acos(cosine)).mean())))
        return found

    def delta(self, levels: Sequence[Weights]) -> float:
        """The band's half width by Eq. 5, x_j being the input's own points and as many more as the band needs."""
        return delta(values(levels, self.everywhere))

    def seconds(self, levels: Sequence[Weights]) -> float:
        """How long `delta`, `lipschitz` and `measure` will take on networks like these."""
        sample = self.held_out[:4096]
        evaluate(levels, sample)
        began = time.perf_counter()
        evaluate(levels, sample)
        points = len(self.everywhere) / 2 + LIPSCHITZ_POINTS + len(self.held_out)  # a value costs half
        return (time.perf_counter() - began) * points / len(sample)


def lipschitz(levels: Sequence[Weights], points: Tensor) -> float:
    """Largest |grad f_i| at points (n, 3), or at `LIPSCHITZ_POINTS` of them."""
    thinned = points[:: max(1, len(points) // LIPSCHITZ_POINTS)]
    return float(torch.linalg.vector_norm(evaluate(levels, thinned)[1], dim=1).max())


def _tensor(array: Doubles, device: torch.device) -> Tensor:
    return torch.from_numpy(array.astype(np.float32)).to(device)
