"""How good trained levels are, measured at points of the surface that training never saw."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..model.field_figures import FieldFigures, field_figures
from . import sampling, tracing
from .bands import delta
from .networks.nested import field, field_and_gradient, in_band, nested_field, nested_field_and_gradient
from .networks.network import Weights
from .shapes.shape import Doubles, Shape
from .tracing import Tracing

POINTS = 100_000
"""Held-out points of the surface that quality is measured at."""
BAND_POINTS = 200_000
"""Points of the surface that Eq. 5 uses beside the held-out ones and the input's own."""
LIPSCHITZ_POINTS = 100_000
"""Points that the largest gradient is measured at, or fewer than twice as many."""
ROUGH_POINTS = 16_384
"""Points that a level is measured at while it is trained."""
WATCHED_POINTS = 1024
"""Points that a level is measured at all the while: less than 1 % of the training's work."""
TRIAL_POINTS = 4096
"""Points that the time of an evaluation is measured at."""
TRIALS = 4
"""Times that it is measured."""
FIELD_POINTS = 20_000
"""Points that the field is compared with the distance at, in the unit ball and in the band each."""
SEED = 0x5EED


@dataclass(frozen=True)
class Quality:
    """How far a level is from the shape, on the shape's surface."""

    mean_f: float
    """Mean |f_i|, model units."""
    angle: float
    """Mean angle between grad f_i and the normal, degrees."""


class FieldProbe:
    """Points of the unit ball with their distances, drawn once, at which the nested field is measured."""

    def __init__(self, shape: Shape, device: torch.device) -> None:
        began = time.perf_counter()
        self._shape, self._device, self._rng = shape, device, np.random.default_rng(SEED)
        self._points, self._distance = self._known(
            sampling.timed(sampling.ball(FIELD_POINTS, 1.0, self._rng), shape.moving, self._rng)
        )
        self._surface = shape.surface(FIELD_POINTS, self._rng, held_out=True).points
        self.seconds = 1.5 * (time.perf_counter() - began)
        """Seconds that `measure` will take, by what the distances of as many points took just now."""

    def measure(self, levels: Sequence[Weights], deltas: Sequence[float]) -> FieldFigures:
        """Measure the field of all levels. deltas: the half widths of the bands of all levels."""
        before = max(1, len(levels) - 1)
        width = deltas[before - 1]
        around = sampling.shifted(self._surface, self._rng.uniform(-width, width, (len(self._surface), 3)))
        inside = in_band(levels[:before], deltas[:before], _tensor(around, self._device)).cpu().numpy()
        band, band_distance = self._known(around[inside])
        _, gradients, _ = nested_field_and_gradient(levels, deltas, _tensor(self._surface, self._device))

        def values(points: Doubles) -> Doubles:
            f, _ = nested_field(levels, deltas, _tensor(points, self._device))
            return f.cpu().numpy().astype(np.float64)

        return field_figures(
            domain=(values(self._points), self._distance),
            band=(values(band), band_distance),
            gradients=gradients[:, :3].cpu().numpy(),
        )

    def _known(self, points: Doubles) -> tuple[Doubles, Doubles]:
        """Return those of the points (N, 3) whose distance is known, and their distances."""
        distance = self._shape.distance(points)
        known = ~np.isnan(distance)
        return points[known], distance[known]


class SurfaceProbe:
    """Points of a shape's surface, drawn once, at which all levels of a training are measured."""

    def __init__(self, shape: Shape, device: torch.device) -> None:
        rng = np.random.default_rng(SEED)
        drawn = shape.surface(POINTS, rng, held_out=True)
        self._held_out, self._normals = (_tensor(array, device) for array in (drawn.points, drawn.normals))
        more = shape.surface(BAND_POINTS, rng).points
        self._all = torch.cat((self._held_out, _tensor(np.concatenate((shape.inputs(), more)), device)))

    def measure(self, levels: Sequence[Weights]) -> list[Quality]:
        """Measure f_1, f_2, ... at the held-out points. Returns one Quality for each level."""
        f, gradient = self._held_out.new_zeros(len(self._held_out)), torch.zeros_like(self._held_out)
        qualities = []
        for weights in levels:
            value_part, gradient_part = field_and_gradient([weights], self._held_out)
            f, gradient = f + value_part, gradient + gradient_part
            cosine = torch.nn.functional.cosine_similarity(gradient[:, :3], self._normals, dim=1).clamp(-1, 1)
            qualities.append(Quality(float(f.abs().mean()), float(torch.rad2deg(torch.acos(cosine)).mean())))
        return qualities

    def delta(self, levels: Sequence[Weights]) -> float:
        """Compute the last level's delta by Eq. 5, at the input's own points and at 300,000 more of the surface."""
        return delta(field(levels, self._all))

    def rough(self, levels: Sequence[Weights]) -> tuple[float, float]:
        """Measure the last level's delta and its largest |grad f_i|, at few points: of a level that is under way."""
        points = self._all[:: max(1, len(self._all) // ROUGH_POINTS)]
        return delta(field(levels, points)), lipschitz(levels, points)

    def watcher(self, frozen: Sequence[Weights]) -> Callable[[Weights], float]:
        """Return a function that measures mean |f_i| of the level after `frozen`, at few of the held-out points."""
        points = self._held_out[:: max(1, len(self._held_out) // WATCHED_POINTS)]
        before = field(frozen, points) if frozen else points.new_zeros(len(points))
        return lambda weights: float((before + field([weights], points)).abs().mean())

    def tracing(self, levels: Sequence[Weights], deltas: Sequence[float]) -> Tracing:
        """Measure how the last level can be traced. deltas: the half widths of the bands of all levels."""
        return tracing.measure(levels, deltas, self._held_out)

    def seconds(self, levels: Sequence[Weights]) -> float:
        """Estimate how many seconds `delta`, `tracing`, `lipschitz` and `measure` will take on networks like these."""
        sample = self._held_out[:TRIAL_POINTS]
        values = len(self._all) + tracing.evaluations(len(levels))
        points = values / 2 + LIPSCHITZ_POINTS + len(self._held_out)  # a value costs half as much
        trials = []
        for _ in range(TRIALS):  # one trial of a few milliseconds may be interrupted by other work: the shortest counts
            began = time.perf_counter()
            field_and_gradient(levels, sample)
            trials.append(time.perf_counter() - began)
        return min(trials) * points / len(sample)


def lipschitz(levels: Sequence[Weights], points: Tensor) -> float:
    """Measure the largest |grad f_i| in space at points (N, 3) or (N, 4), or at every k-th where there are many."""
    thinned = points[:: max(1, len(points) // LIPSCHITZ_POINTS)]
    return float(torch.linalg.vector_norm(field_and_gradient(levels, thinned)[1][:, :3], dim=1).max())


def _tensor(array: Doubles, device: torch.device) -> Tensor:
    return torch.from_numpy(array.astype(np.float32)).to(device)
