"""Quality of trained levels, measured at held-out points."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..model.field_figures import FieldFigures, field_figures
from ..model.model import DELTA_FACTOR
from . import sampling, tracing
from .measuring_config import MeasuringConfig
from .networks.nested import field, field_and_gradient, in_band, nested_field, nested_field_and_gradient
from .networks.network import Weights
from .shapes.shape import Doubles, Shape
from .tracing import Tracing

SEED = 0x5EED


@dataclass(frozen=True)
class Quality:
    """How far a level is from the shape, on the shape's surface."""

    mean_f: float
    """Mean |f_i|, model units."""
    angle: float
    """Mean angle between grad f_i and the normal, degrees."""


class FieldProbe:
    """Measures the nested field at points of the unit ball, drawn once, and in the last level's band."""

    def __init__(self, shape: Shape, device: torch.device, points: int = MeasuringConfig.field_points) -> None:
        """points: of the ball, and of the surface."""
        began = time.perf_counter()
        self._shape, self._device, self._rng = shape, device, np.random.default_rng(SEED)
        self._points, self._distance = self._known(
            sampling.timed(sampling.ball(points, 1.0, self._rng), shape.moving, self._rng)
        )
        self._surface = shape.surface(points, self._rng, held_out=True).points
        self.seconds = 1.5 * (time.perf_counter() - began)
        """Estimate of the seconds of `measure`, from the time of the distances."""

    def measure(self, levels: Sequence[Weights], deltas: Sequence[float]) -> FieldFigures:
        """Measure the field of all levels. deltas: half-widths of all bands."""
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
        """Return the points of (N, 3) whose distance is known, and these distances."""
        distance = self._shape.distance(points)
        known = ~np.isnan(distance)
        return points[known], distance[known]


class SurfaceProbe:
    """Measures levels at points of a shape's surface, drawn once."""

    def __init__(self, shape: Shape, device: torch.device, config: MeasuringConfig | None = None) -> None:
        self._config = config or MeasuringConfig()
        rng = np.random.default_rng(SEED)
        drawn = shape.surface(self._config.points, rng, held_out=True)
        self._held_out, self._normals = (_tensor(array, device) for array in (drawn.points, drawn.normals))
        more = shape.surface(self._config.band_points, rng).points
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
        """Compute the last level's delta by Eq. 5, at the input's own points and at further points of the surface."""
        return delta(field(levels, self._all))

    def rough(self, levels: Sequence[Weights]) -> tuple[float, float]:
        """Measure delta and the largest |grad f_i| of the last level, which is still in training, at few points."""
        points = self._all[:: max(1, len(self._all) // self._config.rough_points)]
        return delta(field(levels, points)), lipschitz(levels, points, self._config.lipschitz_points)

    def watcher(self, frozen: Sequence[Weights]) -> Callable[[Weights], float]:
        """Return a function that measures mean |f_i| of the level after `frozen` at few held-out points."""
        points = self._held_out[:: max(1, len(self._held_out) // self._config.watched_points)]
        before = field(frozen, points) if frozen else points.new_zeros(len(points))
        return lambda weights: float((before + field([weights], points)).abs().mean())

    def tracing(self, levels: Sequence[Weights], deltas: Sequence[float]) -> Tracing:
        """Measure the step bounds of the last level. deltas: half-widths of all bands."""
        return tracing.measure(levels, deltas, self._held_out, self._config.tracing)

    def seconds(self, levels: Sequence[Weights]) -> float:
        """Estimate the seconds of `delta`, `tracing`, `lipschitz` and `measure` for networks of these sizes."""
        config = self._config
        values = len(self._all) + tracing.evaluations(len(levels), config.tracing)
        return self.seconds_each(levels) * (values / 2 + config.lipschitz_points + len(self._held_out))

    def seconds_each(self, levels: Sequence[Weights]) -> float:
        """Time a value and a gradient of networks of these sizes at a point; a value costs half as much."""
        sample, timings = self._held_out[: self._config.timing_points], []
        for _ in range(self._config.timings):  # Other work may interrupt these milliseconds: the shortest count.
            began = time.perf_counter()
            field_and_gradient(levels, sample)
            timings.append(time.perf_counter() - began)
        return min(timings) / len(sample)


def delta(f: Tensor) -> float:
    """Compute delta_i = (1 + epsilon) max_j |f_i(x_j)| (Eq. 5). f: values of f_i at surface points x_j."""
    return DELTA_FACTOR * max(float(f.abs().max()), 1e-6)


def lipschitz(levels: Sequence[Weights], points: Tensor, most: int = MeasuringConfig.lipschitz_points) -> float:
    """Measure the largest |grad f_i| in space at points (N, 3) or (N, 4); at about `most` of them."""
    thinned = points[:: max(1, len(points) // most)]
    return float(torch.linalg.vector_norm(field_and_gradient(levels, thinned)[1][:, :3], dim=1).max())


def _tensor(array: Doubles, device: torch.device) -> Tensor:
    return torch.from_numpy(array.astype(np.float32)).to(device)
