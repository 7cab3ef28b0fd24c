"""One shape of a folder: trained and drawn by processes of their own, so that nothing it does ends the others."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

News = Callable[[str, str, float], None]
"""Receives the name of a job, the stage that it is in, and the share of that stage that is done."""
PICTURE = ("--size", "320", "--samples", "4", "--shade", "studio")
"""How a model is drawn for the page."""


@dataclass(frozen=True)
class Job:
    """A shape to train, as it is sent to a process, or to another machine that sees the same files."""

    name: str
    """Of the model's file, without its ending."""
    shape: str
    """Absolute path."""
    output: str
    """Absolute path of the model's file."""
    options: tuple[str, ...]
    """Of `mplicits train`, for all jobs alike."""
    resume: bool
    """Go on with what an earlier run has left."""
    threads: int
    """Of the processor, at most; 0: as many as there are."""


class Status(StrEnum):
    """What became of a job."""

    TRAINED = "trained"
    KEPT = "kept"
    """An earlier run has trained it."""
    FAILED = "failed"
    STOPPED = "stopped"

    @property
    def has_model(self) -> bool:
        """Whether there is a whole model."""
        return self in (Status.TRAINED, Status.KEPT)


@dataclass(frozen=True)
class Outcome:
    """What came of a job."""

    job: Job
    status: Status
    seconds: float
    """Of wall time."""
    reason: str = ""
    """One line, where it failed."""


class Runner:
    """Runs jobs, and stops those that are running when it is told to."""

    def __init__(self, news: News | None = None) -> None:
        """news: hears how far the jobs are, from any thread."""
        self._news, self._lock, self._stopped = news, threading.Lock(), False
        self._running: set[subprocess.Popen[bytes]] = set()

    def run(self, job: Job) -> Outcome:
        """Train the shape and draw the model. A failure is an outcome, no exception."""
        began = time.perf_counter()
        output = Path(job.output)
        argv = ["train", job.shape, "-o", job.output, "--live", *job.options, *(["--resume"] if job.resume else [])]
        code, said = self._mplicits(argv, job)
        status = Status.STOPPED if self._stopped else Status.FAILED if code else Status.TRAINED
        if status is Status.TRAINED:
            self._mplicits(["render", job.output, "-o", str(output.with_suffix(".png")), "--force", *PICTURE], job)
        reason = (said or f"ended with exit code {code}").removeprefix("mplicits: ") if status is Status.FAILED else ""
        return Outcome(job, status, time.perf_counter() - began, reason)

    def stop(self) -> None:
        """Let every running job save what it has learnt and end, as Ctrl-C does, and no other one begin."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                with contextlib.suppress(ProcessLookupError):
                    process.send_signal(signal.SIGINT)

    def _mplicits(self, argv: list[str], job: Job) -> tuple[int, str]:
        """Run a command line of ours. Returns its exit code, and the last line that it complained in.

        What it prints goes through a pipe: where this process is killed, the other one ends at its next line.
        """
        threads = {"OMP_NUM_THREADS": str(job.threads)} if job.threads else {}
        with tempfile.TemporaryFile() as complaints:
            with self._lock:
                if self._stopped:
                    return 130, ""
                process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "mplicits", *argv],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=complaints,
                    env=os.environ | threads,
                    start_new_session=True,  # Ctrl-C of the terminal comes once, by `stop`
                )
                self._running.add(process)
            assert process.stdout is not None
            with process.stdout as lines:
                for line in lines:
                    self._tell(job, line)
            code = process.wait()
            with self._lock:
                self._running.discard(process)
            complaints.seek(0)
            said = complaints.read().decode(errors="replace").strip().splitlines()
        return code, said[-1] if said else ""

    def _tell(self, job: Job, line: bytes) -> None:
        """Hand on a line of progress (trainer/live.py); others are the training's last words."""
        if self._news is None or not line.startswith(b"{"):
            return
        with contextlib.suppress(ValueError, KeyError, TypeError):
            news = json.loads(line)
            self._news(job.name, str(news["stage"]), float(news["fraction"]))


def run_job(job: Job) -> Outcome:
    """Run a job in a process of a cluster."""
    return Runner().run(job)
