"""Trains and renders each shape of a folder in separate processes, so that a crash cannot end the other jobs."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

Progress = Callable[[str, str, float], None]
"""Receives a job's name, its stage, and the finished share of the stage, in [0, 1]."""
PICTURE = ("--size", "320", "--samples", "4", "--shade", "softbox")
"""Options of `mplicits render` for the pictures of the page."""
POLL = 0.2
"""Seconds between two checks for finished jobs; Ctrl-C takes effect at the next check."""


@dataclass(frozen=True)
class Job:
    """A shape to train."""

    name: str
    """Name of the model's file, without its ending."""
    shape: str
    """Absolute path of the shape."""
    output: str
    """Absolute path of the model."""
    options: tuple[str, ...]
    """Options of `mplicits train`."""
    resume: bool
    """Continue from the state that an earlier run saved."""
    threads: int
    """Largest number of processor threads; 0: all."""


class Status(StrEnum):
    """Result of a job."""

    TRAINED = "trained"
    KEPT = "kept"
    """An earlier run trained the model."""
    FAILED = "failed"
    STOPPED = "stopped"

    @property
    def has_model(self) -> bool:
        """Whether a complete model exists."""
        return self in (Status.TRAINED, Status.KEPT)


@dataclass(frozen=True)
class Outcome:
    """Result of a job, its wall time, and what failed."""

    job: Job
    status: Status
    seconds: float
    reason: str = ""
    """One line: why the job failed, or why a trained model has no picture."""


class Runner:
    """Runs jobs in child processes; `stop` ends them."""

    def __init__(self, progress: Progress) -> None:
        """progress: called from any thread."""
        self._progress, self._lock, self._stopped = progress, threading.Lock(), False
        self._running: set[subprocess.Popen[bytes]] = set()

    def run(self, job: Job) -> Outcome:
        """Train the shape and render the model. A failure is returned, not raised."""
        began = time.perf_counter()
        picture = str(Path(job.output).with_suffix(".png"))
        argv = ["train", job.shape, "-o", job.output, "--live", *job.options, *(["--resume"] if job.resume else [])]
        reason, status = self._mplicits(argv, job), Status.TRAINED
        if self._stopped:
            reason, status = "", Status.STOPPED
        elif reason:
            status = Status.FAILED
        elif problem := self._mplicits(["render", job.output, "-o", picture, *PICTURE], job):
            reason = "" if self._stopped else f"no picture: {problem}"
        return Outcome(job, status, time.perf_counter() - began, reason)

    def stop(self) -> None:
        """Start no further process; interrupt the running ones, which save their state as after Ctrl-C."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                with contextlib.suppress(ProcessLookupError):
                    process.send_signal(signal.SIGINT)

    def _mplicits(self, argv: list[str], job: Job) -> str:
        """Run a command line of mplicits. Returns why it failed, "" for exit code 0.

        The child's stdout is a pipe: if this process is killed, the child ends when it prints its next line.
        """
        threads = {"OMP_NUM_THREADS": str(job.threads)} if job.threads else {}
        with tempfile.TemporaryFile() as errors:
            with self._lock:
                if self._stopped:
                    return "stopped"
                process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "mplicits", *argv],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=errors,
                    env=os.environ | threads,
                    start_new_session=True,  # the terminal's Ctrl-C reaches the child once, through `stop`
                )
                self._running.add(process)
            assert process.stdout is not None
            with process.stdout as lines:
                for line in lines:
                    self._report(job, line)
            code = process.wait()
            with self._lock:
                self._running.discard(process)
            if not code:
                return ""
            errors.seek(0)
            said = errors.read().decode(errors="replace").strip().splitlines()
        return said[-1].removeprefix("mplicits: ") if said else f"ended with exit code {code}"

    def _report(self, job: Job, line: bytes) -> None:
        """Forward a line of progress (trainer/progress.py); other lines of the training are dropped."""
        if not line.startswith(b"{"):
            return
        with contextlib.suppress(ValueError, KeyError, TypeError):
            state = json.loads(line)
            self._progress(job.name, str(state["stage"]), float(state["fraction"]))


def outcomes(jobs: Sequence[Job], parallel: int, progress: Progress) -> Generator[Outcome]:
    """Run jobs `parallel` at a time, and yield each outcome when its job ends.

    When the caller closes the generator, or presses Ctrl-C, running jobs save their state and end.
    """
    runner = Runner(progress)
    with ThreadPoolExecutor(parallel) as pool:
        waiting = {pool.submit(runner.run, job) for job in jobs}
        try:
            while waiting:
                done, waiting = wait(waiting, POLL, FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            for future in waiting:
                future.cancel()
            runner.stop()
