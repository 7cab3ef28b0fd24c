"""Progress on stderr."""

import sys
from typing import NoReturn

from tqdm import tqdm


class Bar:
    """A `parallel.Progress` that people see: a bar for each stage."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._bar: tqdm[NoReturn] | None = None

    def begin(self, stage: str, total: int) -> None:
        """A new bar; the one before is wiped."""
        self.end()
        form = "{desc} |{bar}| {percentage:3.0f}% {remaining} left"
        every = 0.1 if sys.stderr.isatty() else 10.0
        self._bar = tqdm(
            total=total,
            desc=stage,
            bar_format=form,
            disable=self._quiet,
            leave=False,
            file=sys.stderr,
            mininterval=every,
        )

    def advance(self, points: int) -> None:
        """Moves the bar."""
        if self._bar is not None:
            self._bar.update(points)

    def end(self) -> None:
        """Takes the bar away."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
