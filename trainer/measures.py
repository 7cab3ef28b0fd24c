"""What a training measures: each level when it is trained, and the finished model."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from ..model.field_figures import FieldFigures
from ..model.surface_figures import SurfaceRecord
from .finished_networks import Trained, TrainedLevel
from .held_out_errors import FieldProbe, Quality, SurfaceProbe, lipschitz
from .measuring_config import MeasuringConfig
from .networks.network import Weights
from .shapes.shape import Shape
from .surface_distance import SurfaceDistance


class Measures:
    """Measures the networks of a training at points that are drawn once."""

    def __init__(self, shape: Shape, device: torch.device, config: MeasuringConfig) -> None:
        self._config = config
        self.surface = SurfaceProbe(shape, device, config)
        self._field = FieldProbe(shape, device, config.field_points)
        self._distance = SurfaceDistance(shape, device, config.comparing)

    def seconds(self, levels: Sequence[Weights]) -> float:
        """Estimate the seconds of `figures` for networks of these sizes."""
        return self._field.seconds + self._distance.seconds(levels, self.surface.seconds_each(levels))

    def freeze(self, trained: Trained, weights: Weights, samples: Tensor, record: dict[str, Any]) -> None:
        """Measure a trained level, and add it to the finished ones. samples: points that it was trained on."""
        levels, deltas = [*trained.weights(), weights], trained.deltas()
        delta = self.surface.delta(levels)
        tracing = self.surface.tracing(levels, [*deltas, delta])
        sampled = lipschitz(levels, samples, self._config.lipschitz_points)
        *as_bands, last = tracing.step_bounds
        trained.lower_band_bounds(as_bands)
        steepest = max(sampled, tracing.lipschitz)
        trained.levels.append(TrainedLevel(weights, delta, steepest, last, 1.0, record))

    def figures(self, trained: Trained) -> tuple[list[Quality], FieldFigures, SurfaceRecord]:
        """Measure the finished levels, the nested field, and its surface."""
        weights, deltas = trained.weights(), trained.deltas()
        return (
            self.surface.measure(weights),
            self._field.measure(weights, deltas),
            self._distance.measure(weights, deltas),
        )
