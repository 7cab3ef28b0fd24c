"""A training that another program follows: progress as JSON lines, and a model file that appears as levels finish."""

import json
import math
import time
from collections.abc import Callable
from dataclasses import replace

from ..model.model import Model
from .networks.fit import Budget, Progress
from .networks.network import Weights
from .settings import Settings
from .shapes.shape import Shape
from .train import Training

EVERY = 0.25
"""Seconds between lines, at least."""


class Lines:
    """Progress on stdout, an object a line: {"stage", "fraction" of it that is done, "loss"}."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self.say = say
        self._stage, self._next = "", 0.0

    def begin(self, stage: str) -> None:
        """A stage begins."""
        self._stage, self._next = stage, 0.0
        self.advance(0.0, math.nan)

    def advance(self, fraction: float, loss: float) -> None:
        """Share of the stage that is done, and a recent mean of the loss."""
        now = time.perf_counter()
        if now >= self._next:
            self._next = now + EVERY
            news = {"stage": self._stage, "fraction": round(fraction, 4), "loss": loss if math.isfinite(loss) else None}
            print(json.dumps(news), flush=True)

    def end(self) -> None:
        """The stage is over."""


class LiveTraining(Training):
    """Gives `keep` the model after every level, marked as one that was interrupted."""

    def __init__(
        self, shape: Shape, settings: Settings, progress: Progress, began: float, keep: Callable[[Model], None]
    ) -> None:
        super().__init__(shape, settings, progress, began)
        self._keep = keep

    def _train_level(self, index: int, budget: Budget, begun: tuple[Weights, float] | None) -> None:
        super()._train_level(index, budget, begun)
        model = self._model()
        self._keep(replace(model, provenance=model.provenance | {"interrupted": True}))
