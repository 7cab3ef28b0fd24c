"""The next file to load: a file that the user opens, or the watched file when it changes."""

from importlib.resources import files
from pathlib import Path

from ... import glsl
from .source import SHADER_SUFFIXES

WATCH_INTERVAL = 0.4
"""Seconds between two checks of a watched file."""


class Files:
    """The file to open next, and the watched file."""

    def __init__(self, path: Path, watch: bool) -> None:
        """path: the file that is open now. watch: reload it, and every later file, when it changes."""
        self.pending: Path | None = None
        """The file to open next."""
        self._announced = False
        """Whether a call of `tick` has passed since `open`, so that the window could announce the file."""
        self._watches = watch
        self._watch = Watch(path) if watch else None
        self._next_check = 0.0

    def open(self, path: Path) -> None:
        """Make `path` the next file to load."""
        self.pending, self._announced = path, False

    def unwatch(self) -> None:
        """Watch nothing until another file is opened."""
        self._watch = None

    def tick(self, now: float) -> tuple[Path | None, float | None]:
        """Return the file to load now, if any, and the seconds until the next call is due, if any.

        The second call after `open` returns the file: the window announces it first. now: time.perf_counter().
        """
        if self.pending is not None and not self._announced:
            self._announced = True
            return None, 0.0
        path, self.pending = self.pending, None
        if path is not None and self._watches and (self._watch is None or path != self._watch.path):
            self._watch = Watch(path)
        if self._watch is None:
            return path, None
        if now >= self._next_check:
            self._next_check = now + WATCH_INTERVAL
            if self._watch.changed():
                path = self._watch.path
        return path, self._next_check - now


class Watch:
    """Detects changes of a model or shader file, and for a model also of the files in glsl/."""

    def __init__(self, path: Path) -> None:
        self.path, self._paths = path, [path]
        if path.suffix.lower() not in SHADER_SUFFIXES:
            self._paths += [Path(str(entry)) for entry in files(glsl).iterdir() if entry.name.endswith(".glsl")]
        self._last = [signature(path) for path in self._paths]

    def changed(self) -> bool:
        """Return whether a file has changed, appeared or vanished since the last call."""
        last, self._last = self._last, [signature(path) for path in self._paths]
        return last != self._last


def signature(path: Path) -> tuple[int, int] | None:
    """Return a file's modification time, nanoseconds, and length, bytes; None for a missing file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
