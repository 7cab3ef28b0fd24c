"""The optimization of one network: schedule, clock, restarts after a collapse, and Ctrl-C."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import torch

from ...model.interrupts import SecondInterrupt, between_steps
from .callback import Callback, FitState
from .muon import Muon
from .network import Weights
from .snapshot import Resumable, Snapshot

WARM_UP = 0.05  # share of the schedule in which the rate rises; it then falls to zero along a cosine
WATCH_FROM = 0.25  # share of the schedule after which the loss is checked for a collapse; earlier it is always high
IDLE = 0.97  # a network has collapsed if its mean loss exceeds this share of the loss without it
WINDOW = 50  # steps of the mean loss, and the fewest checked steps of a collapse
RESTARTS = 3  # most restarts of one network
SLOWER = 3.0  # each restart divides the rate by this
STATE_KEY = "optimiser"  # in checkpoints, which keep this spelling

Step = Callable[[Weights], float]
"""Adds the gradients of one batch's loss to the weights' .grad. Returns the loss."""


@dataclass(frozen=True)
class Budget:
    """The end of a stage: a number of steps, or a deadline."""

    steps: int | None = None
    """Optimizer steps of the stage; None: use `deadline`."""
    deadline: float = 0.0
    """time.perf_counter() at the end of the stage."""
    done: float = 0.0
    """Share of the schedule that an interrupted training finished."""
    seconds: float = 0.0
    """The stage's share of the user's seconds, its preparation included; unused with `steps`."""

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

    def resume_at(self, share: float) -> None:
        """Resume at `share` after a pause: the rest of the schedule takes the remaining time."""
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
    """Whether the last restart collapsed or diverged; the network then is constant."""


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
    rest: torch.Tensor | None = None
    """Outputs (K,) of a network that never helps; None: zero."""
    draws: Resumable | None = None
    """What changes from step to step beside the weights: random numbers, batches."""


def fit(
    task: Task,
    budget: Budget,
    say: Callable[[str], None],
    callbacks: Sequence[Callback] = (),
    resume: Snapshot | None = None,
) -> Outcome:
    """Train a network until the end of the budget or Ctrl-C.

    A network that collapses (its loss is no better than the loss without it) or diverges starts again at a lower rate,
    at most `RESTARTS` times. A network that never helps ends as zero, or as the task's `rest`, marked
    as failed.

    say: logs a line about a restart. resume: a `FitState.snapshot` of the same task, from which the training resumes;
    with a budget of steps, the result equals that of an uninterrupted training. Raises UserError where
    `resume` does not fit the task.
    """
    rate, first = task.rate, 0
    if resume is not None:
        rate, first = resume.real("rate"), min(resume.whole("restarts"), RESTARTS)
    for restarts in range(first, RESTARTS + 1):
        weights = [w.requires_grad_() for w in task.start()]
        attempt = _Attempt(weights, replace(task, rate=rate), restarts, budget, callbacks, resume)
        attempt.run()
        resume = None
        if not attempt.failed:
            break
        line = (
            f"{attempt.failed} at step {attempt.steps} (loss {attempt.loss:.3g}, {task.idle:.3g} without the network)"
        )
        if restarts == RESTARTS or attempt.interrupted:
            ending = "it adds nothing" if task.rest is None else "its mean stands for it"
            say(f"{line}: {ending}, after {restarts} restarts")
            # A model file takes finite weights alone.
            weights = task.start()
            weights[-2:] = [torch.zeros_like(w) for w in weights[-2:]]
            if task.rest is not None:
                weights[-1] += task.rest.to(weights[-1])
            attempt.loss = task.idle
            break
        say(f"{line}: restarted with rate {rate / SLOWER:.2g}")
        rate /= SLOWER
    return Outcome(
        weights=[w.detach() for w in weights],
        steps=attempt.steps,
        fraction=1.0 if attempt.failed else attempt.share,
        restarts=restarts,
        rate=rate,
        loss=attempt.loss,
        interrupted=attempt.interrupted,
        failed=bool(attempt.failed),
    )


class _Attempt:
    """One attempt, from the start to the end of the budget, a collapse, or Ctrl-C."""

    def __init__(
        self,
        weights: Weights,
        task: Task,
        restarts: int,
        budget: Budget,
        callbacks: Sequence[Callback],
        resume: Snapshot | None,
    ) -> None:
        self._weights, self._task, self._restarts, self._callbacks = weights, task, restarts, callbacks
        self._bare = [w.detach() for w in weights]
        self._optimizer = Muon(weights, task.rate, task.output_factor)
        self.steps, self.share, self.loss = 0, budget.done, 0.0
        self._watched = 0  # Steps since the loss is watched.
        self.failed = ""  # "diverged", "collapsed", or empty.
        self.interrupted = False
        if resume is not None:
            self._restore(resume)
        self._clock = budget.clock()

    def run(self) -> None:
        """Take the steps. Ctrl-C and signals end them between two steps, so that the state can be resumed."""
        with between_steps() as take_signals:
            try:
                while not self.failed:
                    take_signals()
                    if not self._step():
                        break
            except SecondInterrupt:
                raise
            except KeyboardInterrupt:
                self.interrupted = True
            if self.failed:
                return
            state = self._state(self.share)
            if not state.finite():
                self.failed = "diverged"
            elif self.interrupted and self.steps:
                for callback in self._callbacks:
                    callback.after_interrupt(state)

    def _step(self) -> bool:
        """Take a step with its callbacks. Returns False at the end of the schedule."""
        share = self._clock(self.steps)
        if share == 1:
            self.share = 1.0
            return False
        state = self._state(share)
        for callback in self._callbacks:
            callback.before_step(state)
        self._clock.resume_at(share)
        loss = self._task.step(self._weights)
        self._optimizer.step(schedule(share))
        self._watch(loss, share)
        if not self.failed:
            state = self._state(share)
            for callback in self._callbacks:
                callback.after_step(state)
        return True

    def _watch(self, loss: float, share: float) -> None:
        """Count the step, and judge whether the network diverges or collapses."""
        self.steps += 1
        self.share = share
        self._watched = self._watched + 1 if share >= WATCH_FROM else 0
        self.loss += max(1 / WINDOW, 1 / max(1, self._watched)) * (loss - self.loss)
        if not math.isfinite(loss):
            self.failed = "diverged"
        elif self._watched >= WINDOW and self.loss > IDLE * self._task.idle:
            self.failed = "collapsed"

    def _state(self, share: float) -> FitState:
        return FitState(self._bare, self.steps, share, self.share, self.loss, self._clock.left, self._snapshot)

    def _snapshot(self) -> Snapshot:
        numbers = {"steps": self.steps, "fraction": self.share, "watched": self._watched, "loss": self.loss}
        tried = {"rate": self._task.rate, "restarts": self._restarts}
        tensors = {f"weight.{i}": w for i, w in enumerate(self._bare)}
        draws = Snapshot() if self._task.draws is None else self._task.draws.snapshot().inside("draws")
        return Snapshot(numbers, tensors) | self._optimizer.snapshot().inside(STATE_KEY) | draws | Snapshot(tried)

    def _restore(self, resume: Snapshot) -> None:
        with torch.no_grad():
            for i, weight in enumerate(self._weights):
                weight.copy_(resume.tensor(f"weight.{i}", weight))
        self._optimizer.restore(resume.of(STATE_KEY))
        if self._task.draws is not None:
            self._task.draws.restore(resume.of("draws"))
        self.steps, self.share = resume.whole("steps"), resume.real("fraction")
        self._watched, self.loss = resume.whole("watched"), resume.real("loss")
