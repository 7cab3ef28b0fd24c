"""Progress of a training that another program follows (`--live`): lines of JSON."""

import json
import math
import time
from collections.abc import Callable, Mapping

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

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Print nothing of the figures."""

    def end(self) -> None:
        """Print nothing: the next stage's first line says that this one is over."""
