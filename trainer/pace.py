"""How fast the steps of a stage were, and how many of them its seconds hold on an idle machine."""

import time

from .networks.callback import Callback, FitState

IDLE = 20
"""Of this many steps, the fastest one stands for an idle machine: single steps are faster by chance."""


class Pace(Callback):
    """Times the steps of a stage. It comes last among the callbacks, so that it times the steps alone."""

    def __init__(self) -> None:
        self._steps, self._seconds = 0, list[float]()
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
        self._seconds.append(self._ended - self._began)

    def record(self, steps: int, seconds: float) -> dict[str, float]:
        """Return, for the provenance, the steps that the stage's seconds hold, and the seconds that a step took.

        steps: that the stage took, those of interrupted runs included. seconds: its share of the user's seconds; 0
        where steps are counted, which need no record.
        """
        if not (seconds and self._steps):
            return {}
        idle = sorted(self._seconds)[len(self._seconds) // IDLE]
        planned = steps - self._steps + round(seconds / idle)
        return {"steps_planned": max(planned, steps), "step_seconds": (self._ended - self._first) / self._steps}
