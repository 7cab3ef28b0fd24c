"""Where the progress of a training goes: a bar for people, lines of JSON for programs (`--live`), a log (`--log`)."""

import json
import math
import sys
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from io import TextIOWrapper
from pathlib import Path
from typing import NoReturn

from tqdm import TqdmWarning, tqdm

from ..model.errors import UserError
from ..model.files import check_writable, is_special, open_special
from ..model.kinds import LOG
from .networks.callback import TrainingProgress

LIVE_INTERVAL = 0.25
"""Least seconds between two JSON lines of a stage on stdout."""

ProgressCallback = Callable[[str, float, float], object]
"""Receives the stage ("level 1 (64x1)"), the share of it that is done, in [0, 1], and a recent mean of the loss."""


class TrainingBar:
    """A progress bar on stderr: the stage, the share done, the quality, and the time left.

    The quality is mean |f| at held-out points for a level, the color error for a texture, and the loss otherwise.
    In a notebook with ipywidgets the bar is a widget. Without a reader on stderr the training continues.
    """

    def __init__(self, quiet: bool) -> None:
        """quiet: show no bar; lines of the log are still printed."""
        self._quiet = quiet
        self._bar: tqdm[NoReturn] | None = None
        self._figures: Mapping[str, float] = {}

    def begin(self, stage: str) -> None:
        """Show a new bar for the stage."""
        layout = "{desc} |{bar}| {percentage:3.0f}%{postfix} {remaining} left"
        self._figures = {}
        interval = 0.1 if sys.stderr.isatty() else 10.0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TqdmWarning)  # A notebook without ipywidgets gets a bar of text.
            from tqdm.auto import tqdm as bar_for_here
        with suppress(OSError):
            self._bar = bar_for_here(
                total=1.0, desc=stage, bar_format=layout, disable=self._quiet, file=sys.stderr, mininterval=interval
            )

    def advance(self, fraction: float, loss: float) -> None:
        """Move the bar to `fraction`, and show the quality."""
        with suppress(OSError):
            if self._bar is not None:
                self._bar.set_postfix_str(self._quality(loss), refresh=False)
                self._bar.update(fraction - self._bar.n)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Keep the figures for `advance`."""
        self._figures = figures

    def _quality(self, loss: float) -> str:
        if "mean_f" in self._figures:
            return f"mean |f| {self._figures['mean_f']:.2e}"
        if "colour" in self._figures:
            return f"colors off by {math.sqrt(self._figures['colour'] / 3):.3f}"
        return f"loss {loss:.4g}"

    def end(self) -> None:
        """End the bar, and leave it on the screen."""
        with suppress(OSError):
            if self._bar is not None:
                self._bar.close()

    def say(self, line: str) -> None:
        """Print a line above the bar."""
        with suppress(OSError):
            tqdm.write(line, file=sys.stderr)


class ForwardingProgress:
    """A `TrainingProgress` that forwards everything to another one; subclasses add to it."""

    def __init__(self, progress: TrainingProgress) -> None:
        self._progress, self._stage = progress, ""

    def begin(self, stage: str) -> None:
        """Forward the stage."""
        self._stage = stage
        self._progress.begin(stage)

    def advance(self, fraction: float, loss: float) -> None:
        """Forward the share done and the loss."""
        self._progress.advance(fraction, loss)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Forward the figures."""
        self._progress.tell(step, figures)

    def end(self) -> None:
        """Forward the end of the stage."""
        self._progress.end()

    def say(self, line: str) -> None:
        """Forward a line for people."""
        self._progress.say(line)


class CallingProgress(ForwardingProgress):
    """Also calls a function with every report."""

    def __init__(self, progress: TrainingProgress, callback: ProgressCallback) -> None:
        super().__init__(progress)
        self._callback = callback

    def advance(self, fraction: float, loss: float) -> None:
        """Forward, then call."""
        super().advance(fraction, loss)
        self._callback(self._stage, fraction, loss)


class JsonLines:
    """Prints an object a line on stdout: "stage", its "fraction" that is done, "loss"."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """say: receives lines for people, which must not go to stdout."""
        self.say = say
        self._stage, self._next = "", 0.0

    def begin(self, stage: str) -> None:
        """Print a line that the stage begins; its loss is null."""
        self._stage, self._next = stage, 0.0
        self.advance(0.0, math.nan)

    def advance(self, fraction: float, loss: float) -> None:
        """Print a line, unless the last one is too recent."""
        now = time.perf_counter()
        if now >= self._next:
            self._next = now + LIVE_INTERVAL
            line = {"stage": self._stage, "fraction": round(fraction, 4), "loss": loss if math.isfinite(loss) else None}
            print(json.dumps(line), flush=True)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Ignore the figures."""

    def end(self) -> None:
        """Print nothing: the next stage's first line says that this stage is over."""


class TrainingLog(ForwardingProgress):
    """Also writes a line of JSON for every report to a file.

    A line is an object: "level", a number, or null for the texture; "network", as 64x2; "step" of it, "fraction" of its
    schedule, "seconds" since the log began; "loss", a recent mean; the terms of the last batch's loss, without their
    weights ("value", "normal", "distance", "eikonal" of a level; "colour", "along" of a texture); and "mean_f", the
    mean |f| of a level at held-out points of the surface.
    """

    def __init__(self, progress: TrainingProgress, path: Path, *, append: bool = False) -> None:
        """append: continue the log of a resumed training. Raises UserError."""
        check_writable(path, kind=LOG)
        super().__init__(progress)
        self._began = time.perf_counter()
        self._level: int | None = None
        self._network, self._step, self._figures = "", 0, dict[str, float]()
        try:
            self._file = (
                TextIOWrapper(open_special(path), encoding="utf-8")
                if is_special(path)
                else path.open("a" if append else "w", encoding="utf-8")
            )
        except OSError as error:
            raise UserError(f"cannot write {path}: {error.strerror}") from None

    def begin(self, stage: str) -> None:
        """Note the network of a stage such as "level 2 (64x2)" or "texture (64x2)"."""
        kind, _, network = stage.partition(" (")
        self._level = int(kind.split()[1]) if kind.startswith("level") else None
        self._network, self._step, self._figures = network.rstrip(")"), 0, {}
        super().begin(stage)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Note the figures for `advance`."""
        self._step, self._figures = step, dict(figures)
        super().tell(step, figures)

    def advance(self, fraction: float, loss: float) -> None:
        """Write a line. A full disk ends the log, not the training."""
        numbers = {"fraction": fraction, "seconds": time.perf_counter() - self._began, "loss": loss} | self._figures
        line = {"level": self._level, "network": self._network, "step": self._step}
        rounded = {name: float(f"{value:.6g}") if math.isfinite(value) else None for name, value in numbers.items()}
        try:
            if not self._file.closed:
                self._file.write(json.dumps(line | rounded) + "\n")
                self._file.flush()
        except OSError as error:
            self._progress.say(f"warning: the log ends here: {error.strerror}")
            with suppress(OSError):  # Closing writes the rest of the line.
                self._file.close()
        super().advance(fraction, loss)
