"""A training that another program follows: progress as lines of JSON, and a model file after every level (`--live`)."""

import json
import math
import time
from collections.abc import Callable
from dataclasses import replace

from ..model.model import Model
from .networks.fit import TrainingProgress
from .part import Part
from .settings import Settings
from .shapes.shape import Shape
from .train import Training

INTERVAL = 0.25
"""Shortest time between two lines of a stage, seconds."""


class JsonLines:
    """A `TrainingProgress` that prints an object a line on stdout: "stage", its "fraction" that is done, "loss"."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """say: receives the lines of the log, which must not go to stdout."""
        self.say = say
        self._stage, self._next = "", 0.0

    def begin(self, stage: str) -> None:
        """Print a line that the stage begins; its loss is null."""
        self._stage, self._next = stage, 0.0
        self.advance(0.0, math.nan)

    def advance(self, fraction: float, loss: float) -> None:
        """Print a line, unless the last one is too recent."""
        now = time.perf_counter()
        if now >= self._next:
            self._next = now + INTERVAL
            news = {"stage": self._stage, "fraction": round(fraction, 4), "loss": loss if math.isfinite(loss) else None}
            print(json.dumps(news), flush=True)

    def end(self) -> None:
        """Print nothing: the next stage's first line says that this one is over."""


class LiveTraining(Training):
    """A training that hands out the model after every level, marked as an interrupted one."""

    def __init__(
        self,
        shape: Shape,
        settings: Settings,
        progress: TrainingProgress,
        began: float,
        part: Part | None,
        hand_out: Callable[[Model], None],
    ) -> None:
        """hand_out: receives each of these models. See `Training` for the rest."""
        super().__init__(shape, settings, progress, began, part)
        self._hand_out = hand_out

    def _level_finished(self) -> None:
        super()._level_finished()
        model = self._model()
        self._hand_out(replace(model, provenance=model.provenance | {"interrupted": True}))
