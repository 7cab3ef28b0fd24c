"""A progress bar on stderr."""

import sys
from typing import NoReturn

from tqdm import tqdm


class Bar:
    """A `parallel.Progress` with one bar per stage, which disappears when the stage ends."""

    def __init__(self, quiet: bool) -> None:
        """quiet: show no bar."""
        self._quiet = quiet
        self._bar: tqdm[NoReturn] | None = None

    def begin(self, stage: str, total: int) -> None:
        """Start a bar for a stage of `total` points."""
        self.end()
        form = "{desc} |{bar}| {percentage:3.0f}% {remaining} left"
        seconds, delay = (0.1, 0.0) if sys.stderr.isatty() else (10.0, 10.0)  # Logs get bars of long stages alone.
        self._bar = tqdm(
            total=total,
            desc=stage,
            bar_format=form,
            disable=self._quiet,
            leave=False,
            file=sys.stderr,
            mininterval=seconds,
            delay=delay,
        )

    def advance(self, points: int) -> None:
        """Advance the bar."""
        if self._bar is not None:
            self._bar.update(points)

    def end(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
