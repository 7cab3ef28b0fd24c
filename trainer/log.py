"""The log of a training (`--log`): a file that gets a line of JSON for every report."""

import json
import math
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from ..model.errors import UserError
from ..model.files import check_writable
from ..model.kinds import LOG
from .networks.fit import TrainingProgress


class TrainingLog:
    """A `TrainingProgress` that passes everything on, and writes down what it is told.

    A line is an object: "level", a number, or null for the texture; "network", as 64x2; "step" of it, "fraction" of its
    schedule, "seconds" since the log began; "loss", a recent mean; the terms of the last batch's loss, without their
    weights ("value", "normal", "distance", "eikonal" of a level; "colour", "along" of a texture); and "mean_f", the
    mean |f| of a level at points of the surface that it never sees.
    """

    def __init__(self, progress: TrainingProgress, path: Path, *, onward: bool = False) -> None:
        """onward: write below what is there, of a training that is gone on with. Raises UserError."""
        check_writable(path, kind=LOG)
        self._progress, self._began = progress, time.perf_counter()
        self._level: int | None = None
        self._network, self._step, self._figures = "", 0, dict[str, float]()
        try:
            self._file = path.open("a" if onward else "w", encoding="utf-8")
        except OSError as error:
            raise UserError(f"cannot write {path}: {error.strerror}") from None

    def begin(self, stage: str) -> None:
        """Note which network follows: of "level 2 (64x2)", "level 2, loose pieces (64x2)" or "texture (64x2)"."""
        kind, _, network = stage.partition(" (")
        self._level = int(kind.split()[1].rstrip(",")) if kind.startswith("level") else None
        self._network, self._step, self._figures = network.rstrip(")"), 0, {}
        self._progress.begin(stage)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Note the figures, which `advance` writes."""
        self._step, self._figures = step, dict(figures)
        self._progress.tell(step, figures)

    def advance(self, fraction: float, loss: float) -> None:
        """Write a line. A disk that is full ends the log, not the training."""
        numbers = {"fraction": fraction, "seconds": time.perf_counter() - self._began, "loss": loss} | self._figures
        line = {"level": self._level, "network": self._network, "step": self._step}
        rounded = {name: float(f"{value:.6g}") if math.isfinite(value) else None for name, value in numbers.items()}
        try:
            if not self._file.closed:
                self._file.write(json.dumps(line | rounded) + "\n")
                self._file.flush()
        except OSError as error:
            self._progress.say(f"warning: the log ends here: {error.strerror}")
            with suppress(OSError):  # which still has the line to write
                self._file.close()
        self._progress.advance(fraction, loss)

    def end(self) -> None:
        """Pass on that the stage is over."""
        self._progress.end()

    def say(self, line: str) -> None:
        """Pass on a line for people."""
        self._progress.say(line)
