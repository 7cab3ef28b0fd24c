"""One network's optimisation: schedule, clock, collapse and restart, Ctrl-C."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import torch

from .network import Weights
from .optimiser import Optimiser

WARM_UP = 0.05
"""Share of the schedule in which the rate rises; it then falls to zero along a cosine."""
WATCH_FROM = 0.25
"""Share of the schedule from which the loss is watched; earlier it is high at any rate."""
IDLE = 0.97
"""Collapsed: a mean loss above this share of the loss without the network."""
WINDOW = 50
"""Steps that the mean loss reaches back, and the fewest that a verdict takes."""
RESTARTS = 3
SLOWER = 3.0

Step = Callable[[Weights], float]
"""Adds the gradients of one batch to the weights' .grad; returns its loss."""


class Progress(Protocol):
    """What the user sees of a training."""

    def begin(self, stage: str) -> None:
        """A stage begins."""

    def advance(self, fraction: float, loss: float) -> None:
        """Share of the stage that is done, and a recent mean of the loss."""

    def end(self) -> None:
        """The stage is over."""

    def say(self, line: str) -> None:
        """A line for the log."""


@dataclass(frozen=True)
class Budget:
    """How long a stage runs: `steps`, or until `deadline` (time.perf_counter(), seconds). `done`: share done before."""

    steps: int | None = None
    deadline: float = 0.0
    done: float = 0.0

    def clock(self) -> Callable[[int], float]:
        """Steps since now -> share of the schedule done, in [0, 1]."""
        begin, steps = time.perf_counter(), self.steps

        def progress(step: int) -> float:
            if steps is not None:
                share = step / max(1, round(steps * (1 - self.done)))
            else:
                share = (time.perf_counter() - begin) / max(1e-9, self.deadline - begin)
            return min(1.0, self.done + (1 - self.done) * share)

        return progress


@dataclass(frozen=True)
class Outcome:
    """weights: the network. steps: optimiser steps. fraction: share of the schedule done. loss: its recent mean."""

    weights: Weights
    steps: int
    fraction: float
    restarts: int
    rate: float
    loss: float
    interrupted: bool
    failed: bool


def schedule(progress: float) -> float:
    """Factor on the learning rate: a short linear rise, then half a cosine down to zero."""
    if progress < WARM_UP:
        return progress / WARM_UP
    return 0.5 + 0.5 * math.cos(math.pi * (progress - WARM_UP) / (1 - WARM_UP))


@dataclass(frozen=True)
class Task:
    """What `fit` needs to know of a network.

    start: makes it as it begins. step: see `Step`. idle: the loss without it. rate, last: of `Optimiser`.
    """

    start: Callable[[], Weights]
    step: Step
    idle: float
    rate: float
    last: float


def fit(task: Task, budget: Budget, progress: Progress) -> Outcome:
    """Trains a network until the budget is spent or Ctrl-C.

    Where it has collapsed (its loss is no better than without it) or diverged, it begins again at a lower rate,
    `RESTARTS` times at most; the log says so. A network that never helps ends as zero, `failed`.
    """
    rate = task.rate
    for restarts in range(RESTARTS + 1):
        weights = [w.requires_grad_() for w in task.start()]
        run = _run(weights, replace(task, rate=rate), budget, progress)
        if not run.failed:
            break
        line = f"{run.failed} at step {run.steps} (loss {run.loss:.3g}, {task.idle:.3g} without the network)"
        if restarts == RESTARTS:
            progress.say(f"{line}: it adds nothing, after {restarts} restarts")
            weights[-2:] = [torch.zeros_like(w) for w in weights[-2:]]
            break
        progress.say(f"{line}: restarted with rate {rate / SLOWER:.2g}")
        rate /= SLOWER
    fraction = 1.0 if run.failed else run.fraction
    return Outcome(
        [w.detach() for w in weights], run.steps, fraction, restarts, rate, run.loss, run.interrupted, bool(run.failed)
    )


@dataclass
class _Run:
    steps: int = 0
    fraction: float = 0.0
    watched: int = 0
    loss: float = 0.0
    failed: str = ""
    interrupted: bool = False


def _run(weights: Weights, task: Task, budget: Budget, progress: Progress) -> _Run:
    optimiser, clock, run = Optimiser(weights, task.rate, task.last), budget.clock(), _Run(fraction=budget.done)
    try:
        while (share := clock(run.steps)) < 1:
            loss = task.step(weights)
            optimiser.step(schedule(share))
            run.steps += 1
            run.fraction = share
            run.watched = run.watched + 1 if share >= WATCH_FROM else 0
            run.loss += max(1 / WINDOW, 1 / max(1, run.watched)) * (loss - run.loss)
            if not math.isfinite(loss):
                run.failed = "diverged"
            elif run.watched >= WINDOW and run.loss > IDLE * task.idle:
                run.failed = "collapsed"
            if run.failed:
                return run
            if run.steps % 10 == 0:
                progress.advance(share, run.loss)
        run.fraction = 1.0
    except KeyboardInterrupt:
        run.interrupted = True
    return run
