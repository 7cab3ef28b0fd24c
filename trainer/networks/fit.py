"""The optimization of one network: schedule, clock, restarts after a collapse, and Ctrl-C."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import torch

from .network import Weights
from .optimizer import Optimizer
from .snapshot import Resumable, Snapshot

WARM_UP = 0.05  # share of the schedule in which the rate rises; it then falls to zero along a cosine
WATCH_FROM = 0.25  # share of the schedule after which the loss is checked for a collapse; earlier it is always high
IDLE = 0.97  # a network has collapsed if its mean loss exceeds this share of the loss without it
WINDOW = 50  # steps of the mean loss, and the fewest checked steps of a collapse
RESTARTS = 3  # most restarts of one network
SLOWER = 3.0  # each restart divides the rate by this
REPORT_EVERY = 10  # steps between two reports of progress
REVIEWS = (0.3, 0.5, 0.7, 0.85, 0.93)  # shares of the schedule at which hard examples are mined

Step = Callable[[Weights], float]
"""Adds the gradients of one batch's loss to the weights' .grad. Returns the loss."""


class TrainingProgress(Protocol):
    """Reports the progress of a training to a person or a program."""

    def begin(self, stage: str) -> None:
        """Begin a stage: a level or the texture."""

    def advance(self, fraction: float, loss: float) -> None:
        """Report the finished share of the stage, in [0, 1], and a recent mean of the loss."""

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Report figures of the network by name, after a number of steps; `advance` follows."""

    def end(self) -> None:
        """End the stage."""

    def say(self, line: str) -> None:
        """Log one line."""


@dataclass(frozen=True)
class Budget:
    """The end of a stage: a number of steps, or a deadline."""

    steps: int | None = None
    """Optimizer steps of the stage; None: use `deadline`."""
    deadline: float = 0.0
    """time.perf_counter() at the end of the stage."""
    done: float = 0.0
    """Share of the schedule that an interrupted training finished."""

    def clock(self) -> "Clock":
        """Start the clock."""
        return Clock(self)


class Clock:
    """Measures the finished share of a schedule, by steps or by time."""

    def __init__(self, budget: Budget) -> None:
        """budget: its schedule starts now."""
        self._budget, self._share, self._since = budget, budget.done, time.perf_counter()

    def __call__(self, step: int) -> float:
        """Return the share, in [0, 1]. step: steps since the start of the clock."""
        steps, start = self._budget.steps, self._share
        if steps is not None:
            done = step / max(1, round(steps * (1 - start)))
        else:
            done = (time.perf_counter() - self._since) / max(1e-9, self._budget.deadline - self._since)
        return min(1.0, start + (1 - start) * done)

    @property
    def left(self) -> float:
        """Seconds until the deadline; infinite without one."""
        return math.inf if self._budget.steps is not None else self._budget.deadline - time.perf_counter()

    def go_on(self, share: float) -> None:
        """Continue from `share` after a pause: the rest of the schedule uses the remaining time."""
        if self._budget.steps is None:
            self._share, self._since = share, time.perf_counter()


@dataclass(frozen=True)
class Outcome:
    """Result of the optimization of one network."""

    weights: Weights
    steps: int
    """Optimizer steps since the last restart."""
    fraction: float
    """Finished share of the schedule; less than 1 after Ctrl-C."""
    restarts: int
    rate: float
    """Last peak rate of the hidden layers."""
    loss: float
    """Recent mean of the loss."""
    interrupted: bool
    """Whether Ctrl-C ended the optimization."""
    failed: bool
    """Whether the last restart collapsed or diverged; the network then is zero."""


def schedule(progress: float) -> float:
    """Return the factor on the learning rate: a short linear rise, then half a cosine to zero."""
    if progress < WARM_UP:
        return progress / WARM_UP
    return 0.5 + 0.5 * math.cos(math.pi * (progress - WARM_UP) / (1 - WARM_UP))


@dataclass(frozen=True)
class Task:
    """A network to train, for `fit`."""

    start: Callable[[], Weights]
    """Returns the initial network."""
    step: Step
    idle: float
    """Loss without the network."""
    rate: float
    """Peak rate of the hidden layers."""
    output_factor: float
    """Factor on the rate for the output layer."""
    draws: Resumable | None = None
    """Other state of the training step: random numbers, batches."""
    review: Callable[[Weights, float, float], None] | None = None
    """Mines hard examples at the shares REVIEWS; receives the weights, the share, and the remaining seconds."""
    figures: Callable[[Weights], Mapping[str, float]] | None = None
    """Measures the network for each report of progress."""


@dataclass(frozen=True)
class Keeper:
    """Saves the state of `fit` periodically, so that a killed process loses little."""

    due: Callable[[], bool]
    """Whether to save now; called after every step."""
    keep: Callable[[Weights, Snapshot], None]
    """Receives the weights and the state, also after Ctrl-C if there was a step."""


def fit(
    task: Task,
    budget: Budget,
    progress: TrainingProgress,
    keeper: Keeper | None = None,
    resume: Snapshot | None = None,
) -> Outcome:
    """Train a network until the end of the budget or Ctrl-C.

    resume: a state that a keeper of the same task saved, to continue from; with a budget of steps, the result does not
    depend on the interruption. Raises UserError for a state of another task.

    A network that collapses (its loss is no better than the loss without it) or diverges restarts at a lower rate, at
    most `RESTARTS` times, with a log line. A network that never helps becomes zero, marked as failed.
    """
    rate, first = task.rate, 0
    if resume is not None:
        rate, first = resume.real("rate"), min(resume.whole("restarts"), RESTARTS)
    for restarts in range(first, RESTARTS + 1):
        weights = [w.requires_grad_() for w in task.start()]
        state = Snapshot({"rate": rate, "restarts": restarts})
        attempt = _attempt(weights, replace(task, rate=rate), budget, progress, _with(keeper, state), resume)
        resume = None
        if not attempt.failed:
            break
        line = (
            f"{attempt.failed} at step {attempt.steps} (loss {attempt.loss:.3g}, {task.idle:.3g} without the network)"
        )
        if restarts == RESTARTS or attempt.interrupted:
            progress.say(f"{line}: it adds nothing after {restarts} restarts")
            # Diverged weights are not finite, which model files do not allow.
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
    """One attempt, from the start to the end of the budget, a collapse, or Ctrl-C."""

    steps: int = 0
    fraction: float = 0.0
    watched: int = 0
    """Steps since WATCH_FROM."""
    loss: float = 0.0
    failed: str = ""
    """"diverged", "collapsed", or empty."""
    interrupted: bool = False


def _with(keeper: Keeper | None, more: Snapshot) -> Keeper | None:
    """Return a keeper that saves `more`, too."""
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
    optimizer = Optimizer(weights, task.rate, task.output_factor)
    attempt = _Attempt(fraction=budget.done) if resume is None else _restored(weights, optimizer, task, resume)
    clock = budget.clock()
    reviews = [share for share in REVIEWS if task.review and share > attempt.fraction]
    try:
        while (share := clock(attempt.steps)) < 1:
            if task.review and reviews and share >= reviews[0]:
                reviews = [later for later in reviews if later > share]
                task.review([w.detach() for w in weights], share, clock.left)
                clock.go_on(share)
            loss = task.step(weights)
            optimizer.step(schedule(share))
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
                keeper.keep(*_state(weights, optimizer, task, attempt))
        attempt.fraction = 1.0
    except KeyboardInterrupt:
        attempt.interrupted = True
    if not _finite(weights):
        attempt.failed = "diverged"
    elif keeper is not None and attempt.interrupted and attempt.steps:
        keeper.keep(*_state(weights, optimizer, task, attempt))
    return attempt


def _finite(weights: Weights) -> bool:
    return all(bool(torch.isfinite(w).all()) for w in weights)


def _state(weights: Weights, optimizer: Optimizer, task: Task, attempt: _Attempt) -> tuple[Weights, Snapshot]:
    """Return the weights and the state of an attempt."""
    bare = [w.detach() for w in weights]
    numbers = {key: getattr(attempt, key) for key in ("steps", "fraction", "watched", "loss")}
    state = Snapshot(numbers, {f"weight.{i}": w for i, w in enumerate(bare)})
    draws = Snapshot() if task.draws is None else task.draws.snapshot().inside("draws")
    return bare, state | optimizer.snapshot().inside("optimizer") | draws


def _restored(weights: Weights, optimizer: Optimizer, task: Task, resume: Snapshot) -> _Attempt:
    """Restore weights, optimizer and draws from `_state`. Returns the attempt. Raises UserError."""
    with torch.no_grad():
        for i, weight in enumerate(weights):
            weight.copy_(resume.tensor(f"weight.{i}", weight))
    optimizer.restore(resume.of("optimizer"))
    if task.draws is not None:
        task.draws.restore(resume.of("draws"))
    return _Attempt(resume.whole("steps"), resume.real("fraction"), resume.whole("watched"), resume.real("loss"))
