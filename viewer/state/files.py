"""Which file is to be loaded next: one that the user opens, or the watched one when it changes."""

from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path

from ... import glsl
from .source import SHADER_SUFFIXES

WATCH_INTERVAL = 0.4
"""Seconds between two looks at a watched file."""


class Files:
    """The file that waits to be opened, and the file that is watched."""

    def __init__(self, path: Path, watch: bool) -> None:
        """Begin with the file `path`, which is loaded already.

        watch: that file, and each one that is opened later, is to be loaded again when it changes.
        """
        self.pending: Path | None = None
        """The file that waits to be opened."""
        self._announced = False
        """Whether a call of `tick` has seen `pending`, so that the window could say that it is being opened."""
        self._watches = watch
        self._watch = Watch(path) if watch else None
        self._next_look = 0.0

    def open(self, path: Path) -> None:
        """Let `path` be the next file that is loaded."""
        self.pending, self._announced = path, False

    def unwatch(self) -> None:
        """Watch nothing until another file is opened."""
        self._watch = None

    def tick(self, now: float) -> tuple[Path | None, float | None]:
        """Find the file that is to be loaded now, None for no file, and the seconds until the next call is due.

        A file that was opened is given by the second call, because loading takes seconds and the window announces it
        first. now: seconds on the clock of time.perf_counter. The second value is None if no further call is due.
        """
        if self.pending is not None and not self._announced:
            self._announced = True
            return None, 0.0
        path, self.pending = self.pending, None
        if path is not None and self._watches and (self._watch is None or path != self._watch.path):
            self._watch = Watch(path)
        if self._watch is None:
            return path, None
        if now >= self._next_look:
            self._next_look = now + WATCH_INTERVAL
            if self._watch.changed():
                path = self._watch.path
        return path, self._next_look - now


class Watch:
    """Notices changes of a model or shader file; for a model, also of the GLSL files that models are baked with."""

    def __init__(self, path: Path) -> None:
        self.path, self._paths = path, [path]
        if path.suffix.lower() not in SHADER_SUFFIXES:
            self._paths += [Path(str(entry)) for entry in files(glsl).iterdir() if entry.name.endswith(".glsl")]
        self._seen = signatures(self._paths)

    def changed(self) -> bool:
        """Return whether a file has changed, appeared or gone since the last call."""
        now = signatures(self._paths)
        before, self._seen = self._seen, now
        return now != before


def signatures(paths: Iterable[Path]) -> list[tuple[int, int] | None]:
    """Return each file's time of change, in nanoseconds, and its length in bytes; None for a file that is not there."""
    return [_signature(path) for path in paths]


def _signature(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
