"""The work that goes on beside the picture: one job in this process, one training in a process of its own."""

from collections.abc import Callable
from pathlib import Path

from ...model.errors import UserError
from .jobs import Job
from .training_process import TrainingProcess


class Work:
    """At most one job and at most one training; each gives way to the next."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: ends the window's wait for events; a training calls it from another thread."""
        self._wake = wake
        self.job: Job | None = None
        self.job_progress = (0.0, "")
        """The share of the job that is done, from 0 to 1, and what it does now."""
        self._job_draws = False
        self.training: TrainingProcess | None = None
        self.changed = False
        """Whether a job or training has begun, gone on or ended since the owner last reset this."""

    @property
    def progress(self) -> str:
        """One line about the training, or else about the job; empty if neither runs."""
        if self.training is not None:
            return f"{self.training.name}: {self.training.stage} {self.training.fraction:.0%}"
        return f"{self.job_progress[1]} {self.job_progress[0]:.0%}" if self.job is not None else ""

    def begin(self, job: Job, draws: bool = False) -> None:
        """Start a job, and drop the one that runs. draws: it uses the picture's renderer until its share is 1."""
        self.cancel()
        self.job, self._job_draws, self.job_progress = job, draws, (0.0, "")

    def cancel(self) -> None:
        """Drop the job that runs, if one does."""
        if self.job is not None:
            self.job.close()
            self.job, self.changed = None, True

    def cancel_drawing(self) -> None:
        """Drop the job that runs if it still draws, because the renderer that it draws with is about to change."""
        if self._job_draws and self.job_progress[0] < 1.0:
            self.cancel()

    def advance(self) -> str | None:
        """Do the next bit of the job. Return a line for the user if that was the last bit or the job has failed."""
        if self.job is None:
            return None
        before = self.job_progress
        try:
            self.job_progress = next(self.job)
        except StopIteration as end:
            self.job = None
            return str(end.value)
        except UserError as error:
            self.job = None
            return str(error)
        self.changed |= before != self.job_progress
        return None

    def train(self, paths: list[Path], more: tuple[str, ...] = ()) -> None:
        """Train a shape, or import the checkpoints of a model, in the background; see TrainingProcess."""
        self.stop_training()
        self.training, self.changed = TrainingProcess(paths, self._wake, more), True

    def stop_training(self) -> None:
        """End the training, if one runs, and remove its temporary model file."""
        if self.training is not None:
            self.training.stop()
            self.training, self.changed = None, True
