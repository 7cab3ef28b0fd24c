"""The optimisation of one network: its schedule, its clock, restarts after a collapse, and Ctrl-C."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import torch

from .network import Weights
from .optimiser import Optimiser
from .snapshot import Resumable, Snapshot

WARM_UP = 0.05
"""Share of the schedule in which the rate rises; it then falls to zero along a cosine."""
WATCH_FROM = 0.25
"""Share of the schedule from which the loss is watched; earlier it is high at any rate."""
IDLE = 0.97
"""A network has collapsed if its mean loss is above this share of the loss without it."""
WINDOW = 50
"""Steps that the mean loss reaches back, and the fewest steps after which a collapse is declared."""
RESTARTS = 3
"""Most restarts of one network."""
SLOWER = 3.0
"""Factor by which each restart lowers the rate."""
REPORT_EVERY = 10
"""Steps between two reports to the progress."""

REVIEWS = (0.3, 0.5, 0.7, 0.85, 0.93)
"""Shares of the schedule at which a network is reviewed."""

Step = Callable[[Weights], float]
"""Adds the gradients of the loss of one batch to the weights' .grad, and returns that loss."""


class TrainingProgress(Protocol):
    """Receives the progress of a training, for a person or for another program."""

    def begin(self, stage: str) -> None:
        """Announce that a stage begins: a level or the texture."""

    def advance(self, fraction: float, loss: float) -> None:
        """Report the share of the stage that is done, in [0, 1], and a recent mean of the loss."""

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Report figures of the network as it is after so many steps, by name; `advance` follows."""

    def end(self) -> None:
        """Announce that the stage is over."""

    def say(self, line: str) -> None:
        """Log one line."""


@dataclass(frozen=True)
class Budget:
    """How long one stage of a training may run: a number of steps, or until a point in time."""

    steps: int | None = None
    """Optimiser steps of the whole stage; None: `deadline` counts."""
    deadline: float = 0.0
    """Value of time.perf_counter(), in seconds, at which the stage ends."""
    done: float = 0.0
    """Share of the schedule that an interrupted training has already done."""

    def clock(self) -> "Clock":
        """Start the clock."""
        return Clock(self)


class Clock:
    """Tells what share of a schedule is done: by the steps that were taken, or by time."""

    def __init__(self, budget: Budget) -> None:
        """budget: whose schedule begins now."""
        self._budget, self._share, self._since = budget, budget.done, time.perf_counter()

    def __call__(self, step: int) -> float:
        """Return the share, in [0, 1]. step: steps since the clock was started."""
        steps, before = self._budget.steps, self._share
        if steps is not None:
            done = step / max(1, round(steps * (1 - before)))
        else:
            done = (time.perf_counter() - self._since) / max(1e-9, self._budget.deadline - self._since)
        return min(1.0, before + (1 - before) * done)

    @property
    def left(self) -> float:
        """Seconds until the deadline; infinite where steps count."""
        return math.inf if self._budget.steps is not None else self._budget.deadline - time.perf_counter()

    def go_on(self, share: float) -> None:
        """Go on from `share` after a pause: the rest of the schedule gets the time that is left."""
        if self._budget.steps is None:
            self._share, self._since = share, time.perf_counter()


@dataclass(frozen=True)
class Outcome:
    """What became of the optimisation of one network."""

    weights: Weights
    steps: int
    """Optimiser steps since the last restart."""
    fraction: float
    """Share of the schedule done, in [0, 1]; less than 1 after Ctrl-C."""
    restarts: int
    rate: float
    """Peak rate of the hidden layers after the last restart."""
    loss: float
    """Recent mean of the loss."""
    interrupted: bool
    """Whether Ctrl-C ended it."""
    failed: bool
    """Whether it collapsed or diverged even after the last restart; the network is then zero."""


def schedule(progress: float) -> float:
    """Return the factor on the learning rate: a short linear rise, then half a cosine down to zero."""
    if progress < WARM_UP:
        return progress / WARM_UP
    return 0.5 + 0.5 * math.cos(math.pi * (progress - WARM_UP) / (1 - WARM_UP))


@dataclass(frozen=True)
class Task:
    """What `fit` needs to know of a network that it trains."""

    start: Callable[[], Weights]
    """Makes the network as it is before the first step."""
    step: Step
    idle: float
    """The loss without the network."""
    rate: float
    """Peak rate of the hidden layers."""
    output_factor: float
    """Factor on the rate for the output layer."""
    draws: Resumable | None = None
    """What changes from step to step beside the weights: random numbers, batches."""
    review: Callable[[Weights, float, float], None] | None = None
    """Looks at the network at the shares REVIEWS of the schedule, so that later steps may mend what it finds; it is
    told the share that is done, and the seconds that are left."""
    figures: Callable[[Weights], Mapping[str, float]] | None = None
    """Measures the network each time that the progress is told."""


@dataclass(frozen=True)
class Keeper:
    """Keeps the state of `fit` now and then, so that little is lost where the process ends."""

    due: Callable[[], bool]
    """Whether to keep it now; asked after every step."""
    keep: Callable[[Weights, Snapshot], None]
    """Receives the weights and the whole state, also where Ctrl-C ends a training that has taken a step."""


def fit(
    task: Task,
    budget: Budget,
    progress: TrainingProgress,
    keeper: Keeper | None = None,
    resume: Snapshot | None = None,
) -> Outcome:
    """Train a network until the budget is spent or Ctrl-C is pressed.

    resume: a state that a keeper of the same task was given, to go on from. With a budget of steps the network becomes
    what it would have been without the break. Raises UserError where it is no such state.

    Where it collapses (its loss is no better than the loss without it) or diverges, it begins again at a lower rate,
    `RESTARTS` times at most, and the log says so. A network that never helps ends as zero, marked as failed.
    """
    rate, first = task.rate, 0
    if resume is not None:
        rate, first = resume.real("rate"), min(resume.whole("restarts"), RESTARTS)
    for restarts in range(first, RESTARTS + 1):
        weights = [w.requires_grad_() for w in task.start()]
        tried = Snapshot({"rate": rate, "restarts": restarts})
        attempt = _attempt(weights, replace(task, rate=rate), budget, progress, _with(keeper, tried), resume)
        resume = None
        if not attempt.failed:
            break
        line = (
            f"{attempt.failed} at step {attempt.steps} (loss {attempt.loss:.3g}, {task.idle:.3g} without the network)"
        )
        if restarts == RESTARTS or attempt.interrupted:
            progress.say(f"{line}: it adds nothing, after {restarts} restarts")
            # What has diverged is not finite, and no model file would take it.
            weights = task.start()
            weights[-2:] = [torch.zeros_like(w) for w in weights[-2:]]
            attempt.loss = task.idle
            break
        progress.say(f"{line}: restarted with rate {rate / SLOWER:.2g}")
        rate /= SLOWER
    return Outcome(
        weights=[w.detach() for w in weights],
        steps=attempt.steps,
        fraction=1.0 if attempt.failed else attempt.fraction,
        restarts=restarts,
        rate=rate,
        loss=attempt.loss,
        interrupted=attempt.interrupted,
        failed=bool(attempt.failed),
    )


@dataclass
class _Attempt:
    """One attempt at a network, from its start to the end of the budget, a collapse, or Ctrl-C."""

    steps: int = 0
    fraction: float = 0.0
    watched: int = 0
    """Steps since the loss is watched."""
    loss: float = 0.0
    failed: str = ""
    """"diverged", "collapsed", or empty."""
    interrupted: bool = False


def _with(keeper: Keeper | None, more: Snapshot) -> Keeper | None:
    """Return a keeper that keeps `more`, too."""
    if keeper is None:
        return None
    keep = keeper.keep
    return Keeper(keeper.due, lambda weights, snapshot: keep(weights, snapshot | more))


def _attempt(
    weights: Weights,
    task: Task,
    budget: Budget,
    progress: TrainingProgress,
    keeper: Keeper | None,
    resume: Snapshot | None,
) -> _Attempt:
    optimiser = Optimiser(weights, task.rate, task.output_factor)
    attempt = _Attempt(fraction=budget.done) if resume is None else _restored(weights, optimiser, task, resume)
    clock = budget.clock()
    reviews = [share for share in REVIEWS if task.review and share > attempt.fraction]
    try:
        while (share := clock(attempt.steps)) < 1:
            if task.review and reviews and share >= reviews[0]:
                reviews = [later for later in reviews if later > share]
                task.review([w.detach() for w in weights], share, clock.left)
                clock.go_on(share)
            loss = task.step(weights)
            optimiser.step(schedule(share))
            attempt.steps += 1
            attempt.fraction = share
            attempt.watched = attempt.watched + 1 if share >= WATCH_FROM else 0
            attempt.loss += max(1 / WINDOW, 1 / max(1, attempt.watched)) * (loss - attempt.loss)
            if not math.isfinite(loss):
                attempt.failed = "diverged"
            elif attempt.watched >= WINDOW and attempt.loss > IDLE * task.idle:
                attempt.failed = "collapsed"
            if attempt.failed:
                return attempt
            if attempt.steps % REPORT_EVERY == 0:
                if task.figures is not None:
                    progress.tell(attempt.steps, task.figures([w.detach() for w in weights]))
                progress.advance(share, attempt.loss)
            if keeper is not None and keeper.due() and _finite(weights):
                keeper.keep(*_state(weights, optimiser, task, attempt))
        attempt.fraction = 1.0
    except KeyboardInterrupt:
        attempt.interrupted = True
    if not _finite(weights):
        attempt.failed = "diverged"
    elif keeper is not None and attempt.interrupted and attempt.steps:
        keeper.keep(*_state(weights, optimiser, task, attempt))
    return attempt


def _finite(weights: Weights) -> bool:
    return all(bool(torch.isfinite(w).all()) for w in weights)


def _state(weights: Weights, optimiser: Optimiser, task: Task, attempt: _Attempt) -> tuple[Weights, Snapshot]:
    """Return the weights, and the whole state of an attempt."""
    bare = [w.detach() for w in weights]
    numbers = {key: getattr(attempt, key) for key in ("steps", "fraction", "watched", "loss")}
    state = Snapshot(numbers, {f"weight.{i}": w for i, w in enumerate(bare)})
    draws = Snapshot() if task.draws is None else task.draws.snapshot().inside("draws")
    return bare, state | optimiser.snapshot().inside("optimiser") | draws


def _restored(weights: Weights, optimiser: Optimiser, task: Task, resume: Snapshot) -> _Attempt:
    """Set weights, optimiser and draws to a state of `_state`, and return the attempt. Raises UserError."""
    with torch.no_grad():
        for i, weight in enumerate(weights):
            weight.copy_(resume.tensor(f"weight.{i}", weight))
    optimiser.restore(resume.of("optimiser"))
    if task.draws is not None:
        task.draws.restore(resume.of("draws"))
    return _Attempt(resume.whole("steps"), resume.real("fraction"), resume.whole("watched"), resume.real("loss"))
