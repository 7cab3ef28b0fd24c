"""How fast the steps of a stage were, and how many of them its seconds hold on an idle machine."""

import math
import time

from .networks.callback import Callback, FitState


class Pace(Callback):
    """Times the steps of a stage. It comes last among the callbacks, so that it times the steps alone."""

    def __init__(self) -> None:
        self._steps, self._fastest = 0, math.inf
        self._first, self._began, self._ended = 0.0, 0.0, 0.0

    def before_step(self, state: FitState) -> None:
        """Start the clock."""
        self._began = time.perf_counter()
        if not state.steps:  # The first one, or a restart.
            self._steps = 0
        if not self._steps:
            self._first = self._began

    def after_step(self, state: FitState) -> None:
        """Stop the clock."""
        self._ended = time.perf_counter()
        self._steps += 1
        self._fastest = min(self._fastest, self._ended - self._began)

    def record(self, steps: int, seconds: float) -> dict[str, float]:
        """Return, for the provenance, the steps that the stage's seconds hold, and the seconds that a step took.

        steps: that the stage took, those of interrupted runs included. seconds: its share of the user's seconds; 0
        where steps are counted, which need no record. The fastest step stands for an idle machine.
        """
        if not (seconds and self._steps):
            return {}
        planned = steps - self._steps + round(seconds / self._fastest)
        return {"steps_planned": max(planned, steps), "step_seconds": (self._ended - self._first) / self._steps}
