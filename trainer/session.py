"""One call of `mplicits train`: load, train with a progress bar, save, print the figures."""

import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import NoReturn

from tqdm import tqdm

from ..model.errors import UserError
from ..model.files import show
from ..model.model import Model, load, save
from .live import Lines, LiveTraining
from .machine import prepare
from .settings import Settings
from .shapes.load import load_shape
from .train import Training, device


class Bar:
    """Progress on stderr: stage, share done, loss, time left."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._bar: tqdm[NoReturn] | None = None

    def begin(self, stage: str) -> None:
        """A new bar."""
        form = "{desc} |{bar}| {percentage:3.0f}%{postfix} {remaining} left"
        every = 0.1 if sys.stderr.isatty() else 10.0
        self._bar = tqdm(
            total=1.0, desc=stage, bar_format=form, disable=self._quiet, file=sys.stderr, mininterval=every
        )

    def advance(self, fraction: float, loss: float) -> None:
        """Moves the bar."""
        if self._bar is not None:
            self._bar.set_postfix_str(f"loss {loss:.4g}", refresh=False)
            self._bar.update(fraction - self._bar.n)

    def end(self) -> None:
        """Leaves the bar on the screen."""
        if self._bar is not None:
            self._bar.close()

    def say(self, line: str) -> None:
        """A line above the bar."""
        tqdm.write(line, file=sys.stderr)


def run(
    name: str,
    output: Path,
    settings: Settings,
    *,
    image: Path | None,
    resume: bool,
    quiet: bool,
    began: float,
    live: bool = False,
) -> None:
    """See `trainer.cli`. image: of the texture, if not the mesh's own. began: time.perf_counter() of --seconds' start.

    Raises UserError, and KeyboardInterrupt where Ctrl-C came before there was anything to save.
    """
    prepare(device(settings.device))
    bar = Bar(quiet)
    before = load(output) if resume and output.exists() else None
    shape, warnings = load_shape(name, image)
    for warning in warnings:
        bar.say(f"warning: {warning}")
    if live:
        training: Training = LiveTraining(shape, settings, Lines(bar.say), began, partial(save, path=output))
    else:
        training = Training(shape, settings, bar, began)
    model = training.run(before)
    _save(model, output)
    if training.interrupted:
        bar.say("stopped by Ctrl-C; what is trained so far is saved; go on with --resume")
    print(report(model, output))


def _save(model: Model, output: Path) -> None:
    """Saves to `output`, or, where that fails after all (a full disk), to the system's folder for temporary files."""
    try:
        save(model, output)
    except UserError as error:
        rescue = Path(tempfile.gettempdir()) / output.name
        save(model, rescue)
        raise UserError(f"{error}; the trained model is in {show(rescue)}") from None


def report(model: Model, output: Path) -> str:
    """The figures of a trained model, a line a level."""
    lines = [
        f"level {i}: {record['network']}, mean |f| {record['mean_f']:.2e}, "
        f"mean normal angle {record['angle']:.2f} degrees, delta {level.delta:.4f}, {record['steps']} steps"
        for i, (level, record) in enumerate(zip(model.levels, model.provenance["levels"], strict=True), start=1)
    ]
    lines.append(f"{show(output)}: {model.parameters()} parameters, {model.provenance['seconds']:.1f} s")
    return "\n".join(lines)
