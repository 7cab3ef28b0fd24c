"""A model that is made while the window stays open: `mplicits train` or `import` as a process of its own."""

import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

from ...model.files import show
from .source import CHECKPOINTS, signatures


class Training:
    """Trains a shape, or imports checkpoints, into a temporary model file that appears as levels finish.

    paths: of one shape, or of the networks of one model: the smallest file is the coarsest level.

    stage, fraction: what is trained and how much of it is done. wake: called, from another thread, at every news.
    """

    def __init__(self, paths: list[Path], wake: Callable[[], None], more: tuple[str, ...] = ()) -> None:
        self.name = show(paths[-1].name)
        self.stage, self.fraction = "reading", 0.0
        self._folder = tempfile.TemporaryDirectory(prefix="mplicits-", ignore_cleanup_errors=True)
        self.model = Path(self._folder.name) / f"{paths[-1].stem}.safetensors"
        self._seen = signatures([self.model])
        self._log: list[str] = []
        self._imports = paths[0].suffix.lower() in CHECKPOINTS
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
        """The process is there, or has news that were not read."""
        return self._reader.is_alive()

    def outcome(self) -> str:
        """Of a training that is over: what it says last."""
        if self._process.wait() == 0:
            return f"{self.name} is {'imported' if self._imports else 'trained'}; export the model to keep it"
        return show(self._log[-1].removeprefix("mplicits: ") if self._log else f"training {self.name} failed")

    def news(self) -> bool:
        """Whether the model file is another than at the last call."""
        now = signatures([self.model])
        before, self._seen = self._seen, now
        return now not in (before, [None])

    def stop(self) -> None:
        """Ends the process, if need be, and removes the temporary file."""
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
                news = json.loads(line)
                self.stage, self.fraction = show(str(news["stage"])), float(news["fraction"])
            except (ValueError, KeyError, TypeError):
                self._log.append(line.strip())
            wake()
        self._process.stdout.close()
        wake()
