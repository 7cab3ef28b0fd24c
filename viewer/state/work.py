"""Background work: one job in this process, and one training in its own process."""

from collections.abc import Callable
from pathlib import Path

from ...model.errors import UserError
from .jobs import Job
from .training_process import TrainingProcess


class Work:
    """At most one job and one training; a new one replaces the old one."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: ends the window's wait for events; a training calls it from another thread."""
        self._wake = wake
        self.job: Job | None = None
        self.job_progress = (0.0, "")
        """The completed share of the job, from 0 to 1, and its current activity."""
        self._job_draws = False
        self.training: TrainingProcess | None = None
        self.changed = False
        """Whether a job or training has made progress; the owner resets it."""

    @property
    def progress(self) -> str:
        """A line about the training, else about the job; "" if neither runs."""
        if self.training is not None:
            return f"{self.training.name}: {self.training.stage} {self.training.fraction:.0%}"
        return f"{self.job_progress[1]} {self.job_progress[0]:.0%}" if self.job is not None else ""

    def begin(self, job: Job, draws: bool = False) -> None:
        """Start a job instead of the current one. draws: it uses the picture's renderer until its share is 1."""
        self.cancel()
        self.job, self._job_draws, self.job_progress = job, draws, (0.0, "")

    def cancel(self) -> None:
        """Cancel the job, if any."""
        if self.job is not None:
            self.job.close()
            self.job, self.changed = None, True

    def cancel_drawing(self) -> None:
        """Cancel the job if it still draws: its renderer is about to change."""
        if self._job_draws and self.job_progress[0] < 1.0:
            self.cancel()

    def advance(self) -> str | None:
        """Do the next step of the job; return a line for the user when it ends or fails."""
        if self.job is None:
            return None
        try:
            progress = next(self.job)
        except (StopIteration, UserError) as end:
            self.job = None
            return str(end.value if isinstance(end, StopIteration) else end)
        self.changed |= progress != self.job_progress
        self.job_progress = progress
        return None

    def train(self, paths: list[Path], more: tuple[str, ...] = ()) -> None:
        """Train a shape, or import checkpoints, in the background; the arguments are those of TrainingProcess."""
        self.stop_training()
        self.training, self.changed = TrainingProcess(paths, self._wake, more), True

    def stop_training(self) -> None:
        """End the training, if any, and remove its temporary model file."""
        if self.training is not None:
            self.training.stop()
            self.training, self.changed = None, True
