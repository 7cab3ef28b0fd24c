"""A model that is made while the window stays open: `mplicits train` or `import` as a process of its own."""

import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

from ...model.files import show
from .files import signatures
from .source import CHECKPOINT_SUFFIXES


class TrainingProcess:
    """Trains a shape, or imports checkpoints, into a temporary model file that is written anew as levels finish."""

    def __init__(self, paths: list[Path], wake: Callable[[], None], more: tuple[str, ...] = ()) -> None:
        """Start the process.

        paths: one shape, or the checkpoints of one model, of which the smallest file is the coarsest level.
        wake: called, from another thread, at every line that the process prints and at its end.
        more: further arguments of the verb.
        """
        self.shape = paths[0]
        """The file that is trained on, or a checkpoint."""
        self.name = show(paths[-1].name)
        self.stage, self.fraction = "reading", 0.0
        """What the process does now, and the share of it that is done, from 0 to 1."""
        self._folder = tempfile.TemporaryDirectory(prefix="mplicits-", ignore_cleanup_errors=True)
        self.model = Path(self._folder.name) / f"{paths[-1].stem}.safetensors"
        """The temporary model file, which is there once the first level can be shown."""
        self.versions = 0
        """How often `has_new_model` has found another model file."""
        self._seen = signatures([self.model])
        self._log: list[str] = []
        self._imports = paths[0].suffix.lower() in CHECKPOINT_SUFFIXES
        verb = ("import",) if self._imports else ("train", "--live")
        sizes = {path: path.stat().st_size if path.exists() else 0 for path in paths}
        arguments = [
            sys.executable,
            "-m",
            "mplicits",
            *verb,
            "-o",
            str(self.model),
            *more,
            "--",
            *(str(path.absolute()) for path in sorted(paths, key=sizes.__getitem__)),
        ]
        self._process = subprocess.Popen(
            arguments,
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
        """Whether the process runs, or has printed lines that are not read yet."""
        return self._reader.is_alive()

    def outcome(self) -> str:
        """Wait for the end of the process; return a line that says how it ended."""
        if self._process.wait() == 0:
            return f"{self.name} is {'imported' if self._imports else 'trained'}; export the model to keep it"
        return show(self._log[-1].removeprefix("mplicits: ") if self._log else f"training {self.name} failed")

    def has_new_model(self) -> bool:
        """Return whether the model file is there and has changed since the last call."""
        now = signatures([self.model])
        before, self._seen = self._seen, now
        if now in (before, [None]):
            return False
        self.versions += 1
        return True

    def stop(self) -> None:
        """End the process if it still runs, and remove the temporary file."""
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
