"""Progress of long work, shown on stderr."""

import sys
from typing import NoReturn

from tqdm import tqdm


class Bar:
    """A `parallel.Progress` that people see: one bar for each stage of the work, wiped when the stage is over."""

    def __init__(self, quiet: bool) -> None:
        """Prepare the bars. quiet: show none."""
        self._quiet = quiet
        self._bar: tqdm[NoReturn] | None = None

    def begin(self, stage: str, total: int) -> None:
        """Begin a stage of `total` points with a new bar; the one before is wiped."""
        self.end()
        form = "{desc} |{bar}| {percentage:3.0f}% {remaining} left"
        seconds = 0.1 if sys.stderr.isatty() else 10.0
        self._bar = tqdm(
            total=total,
            desc=stage,
            bar_format=form,
            disable=self._quiet,
            leave=False,
            file=sys.stderr,
            mininterval=seconds,
        )

    def advance(self, points: int) -> None:
        """Move the bar by so many points."""
        if self._bar is not None:
            self._bar.update(points)

    def end(self) -> None:
        """Wipe the bar, if there is one."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
