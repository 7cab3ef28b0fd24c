"""A training in the background of the window: `mplicits train` or `mplicits import` as a process."""

import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

from ...model.files import show
from .files import signature
from .source import CHECKPOINT_SUFFIXES


class TrainingProcess:
    """Trains a shape, or imports checkpoints, into a temporary model file that is updated as levels finish."""

    def __init__(self, paths: list[Path], wake: Callable[[], None], more: tuple[str, ...] = ()) -> None:
        """Start the process.

        paths: a shape, or the checkpoints of a model; the smallest checkpoint is the coarsest level. wake: called from
        another thread after every line of output and at the end. more: arguments of the verb.
        """
        self.shape = paths[0]
        self.name = show(paths[-1].name)
        self.stage, self.fraction = "reading", 0.0
        """The current activity, and its completed share, from 0 to 1."""
        self._folder = tempfile.TemporaryDirectory(prefix="mplicits-", ignore_cleanup_errors=True)
        self.model = Path(self._folder.name) / f"{paths[-1].stem}.safetensors"
        """The temporary model file; it does not exist before the first level."""
        self.versions = 0
        """Number of versions of the model file that `has_new_model` has found."""
        self._last = signature(self.model)
        self._log: list[str] = []
        self._imports = paths[0].suffix.lower() in CHECKPOINT_SUFFIXES
        verb = ("import",) if self._imports else ("train", "--live")
        by_size = sorted(paths, key=lambda path: path.stat().st_size if path.exists() else 0)
        inputs = [str(path.absolute()) for path in by_size]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "mplicits", *verb, "-o", str(self.model), *more, "--", *inputs],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, args=(wake,), daemon=True)
        self._reader.start()

    @property
    def running(self) -> bool:
        """Whether the process runs, or has output left to read."""
        return self._reader.is_alive()

    def outcome(self) -> str:
        """Wait for the end of the process; return a line about its outcome."""
        if self._process.wait() == 0:
            return f"{self.name} is {'imported' if self._imports else 'trained'}; export the model to keep it"
        return show(self._log[-1].removeprefix("mplicits: ") if self._log else f"training {self.name} failed")

    def has_new_model(self) -> bool:
        """Return whether the model file exists and has changed since the last call."""
        last, self._last = self._last, signature(self.model)
        if self._last in (last, None):
            return False
        self.versions += 1
        return True

    def stop(self) -> None:
        """End the process, and remove the temporary file."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(5.0)
            except subprocess.TimeoutExpired:
                self._process.kill()
        self._process.wait()
        self._reader.join(5.0)
        self._folder.cleanup()

    def _read(self, wake: Callable[[], None]) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                report = json.loads(line)
                self.stage, self.fraction = show(str(report["stage"])), float(report["fraction"])
            except (ValueError, KeyError, TypeError):
                self._log.append(line.strip())
            wake()
        self._process.stdout.close()
        wake()
