"""Callbacks of a training: what happens beside its optimizer steps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import torch

from ...model.model import Model
from .network import Weights
from .snapshot import Snapshot


class TrainingProgress(Protocol):
    """Receives the progress of a training, for a person or for another program."""

    def begin(self, stage: str) -> None:
        """Announce that a stage begins: a level or the texture."""

    def advance(self, fraction: float, loss: float) -> None:
        """Report the share of the stage that is done, in [0, 1], and a recent mean of the loss."""

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Report figures of the network by name, after `step` steps; `advance` follows."""

    def end(self) -> None:
        """Announce that the stage is over."""

    def say(self, line: str) -> None:
        """Log one line."""


@dataclass(frozen=True, eq=False)
class FitState:
    """The state of one network under training, for callbacks."""

    weights: Weights
    """Without gradients."""
    steps: int
    """Optimizer steps since the last restart."""
    share: float
    """Share of the schedule that is done, in [0, 1]."""
    previous_share: float
    """The same at the step before."""
    loss: float
    """Recent mean of the loss."""
    seconds_left: float
    """Seconds until the end of the schedule; infinite where steps count."""
    snapshot: Callable[[], Snapshot]
    """Returns all that is needed to resume the training from here."""

    def reaches(self, shares: Sequence[float]) -> bool:
        """Whether the schedule reaches one of these shares with this step."""
        return any(self.previous_share < share <= self.share for share in shares)

    def finite(self) -> bool:
        """Whether all weights are finite."""
        return all(bool(torch.isfinite(w).all()) for w in self.weights)


class Callback:
    """Something that happens while networks are trained; a subclass overrides the events that it needs."""

    def before_step(self, state: FitState) -> None:
        """Run before an optimizer step. The schedule pauses meanwhile."""

    def after_step(self, state: FitState) -> None:
        """Run after an optimizer step."""

    def after_interrupt(self, state: FitState) -> None:
        """Run when Ctrl-C has ended a network's training after at least one step."""

    def after_level(self, model: Callable[[], Model]) -> None:
        """Run when a level is trained. model: returns the model so far, measured."""


class Report(Callback):
    """Reports figures and the loss to a `TrainingProgress`."""

    def __init__(
        self,
        progress: TrainingProgress,
        figures: Callable[[Weights], Mapping[str, float]] | None = None,
        every: int = 10,
    ) -> None:
        """figures: measures the network. every: steps between two reports."""
        self._progress, self._figures, self._every = progress, figures, every

    def after_step(self, state: FitState) -> None:
        """Report after every `every`-th step."""
        if state.steps % self._every == 0:
            if self._figures is not None:
                self._progress.tell(state.steps, self._figures(state.weights))
            self._progress.advance(state.share, state.loss)
