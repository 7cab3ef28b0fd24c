"""One run of `mplicits train`: load the shape, train with a progress bar, save the model, print the figures."""

import math
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from tqdm import TqdmWarning, tqdm

from ..model.errors import UserError
from ..model.field_figures import written
from ..model.files import show
from ..model.interrupts import ended_by
from ..model.model import Model
from ..model.model_file import load, save
from ..model.orientation import DEFAULT_UP, FILES_UP
from .automatic import chosen
from .last_look import FindsPieces
from .live import JsonLines
from .log import TrainingLog
from .machine import device, prepare
from .networks.fit import TrainingProgress
from .networks.snapshot import Snapshot
from .part import Part
from .settings import Settings
from .shapes.load import load_shape
from .shapes.shape import Shape
from .train import Training

Loader = Callable[[TrainingProgress], tuple[Shape, list[str]]]
"""Makes a shape, and the warnings for the user; it shows its progress."""


class TrainingBar:
    """A `TrainingProgress` that people see: a bar on stderr: the stage, the share done, how good it is, the time left.

    Of a level it shows mean |f| at points of the surface that training never sees; of a texture, how far its colours
    are from the shape's; of what has no such figures, the loss. In a notebook that has ipywidgets the bar is one of
    theirs.
    """

    def __init__(self, quiet: bool) -> None:
        """quiet: show no bar; lines of the log are printed all the same."""
        self._quiet = quiet
        self._bar: tqdm[NoReturn] | None = None
        self._figures: Mapping[str, float] = {}

    # Whoever reads stderr may leave, or a terminal be closed: no training ends because nobody sees it.

    def begin(self, stage: str) -> None:
        """Show a new bar for the stage."""
        layout = "{desc} |{bar}| {percentage:3.0f}%{postfix} {remaining} left"
        self._figures = {}
        interval = 0.1 if sys.stderr.isatty() else 10.0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TqdmWarning)  # a notebook without ipywidgets shows a bar of text
            from tqdm.auto import tqdm as fitting
        with suppress(OSError):
            self._bar = fitting(
                total=1.0, desc=stage, bar_format=layout, disable=self._quiet, file=sys.stderr, mininterval=interval
            )

    def advance(self, fraction: float, loss: float) -> None:
        """Move the bar to the share `fraction` of the stage, and show how good the network is."""
        with suppress(OSError):
            if self._bar is not None:
                self._bar.set_postfix_str(self._shown(loss), refresh=False)
                self._bar.update(fraction - self._bar.n)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        """Keep the figures, which `advance` shows."""
        self._figures = figures

    def _shown(self, loss: float) -> str:
        if "mean_f" in self._figures:
            return f"mean |f| {self._figures['mean_f']:.2e}"
        if "colour" in self._figures:
            return f"colours off by {math.sqrt(self._figures['colour'] / 3):.3f}"
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
    crease: float | None = None,
    thicken: float | None = None,
    load_moving: Loader | None = None,
    log: Path | None = None,
    follow: Callable[[Model], object] | None = None,
    find: FindsPieces | None = None,
) -> Model:
    """Train the shape `name` as `mplicits train` does, write the model to `output`, and return it.

    image: the file of the texture, where it is not the mesh's own. resume: go on with the training that was cut short,
    or else with what `output` holds. quiet: show no progress bar. began: the value of time.perf_counter() from which on
    the user's seconds count. live: print progress as JSON, and save after every level. crease, thicken: as of
    `load_shape`. load_moving: makes a shape that moves, in place of what `name` is. log: a file that gets a line of
    JSON for every report. follow: receives the model after every level. find: as of `Training`. Raises UserError,
    and KeyboardInterrupt where Ctrl-C came before there was anything to save.
    """
    bar = TrainingBar(quiet)
    part = Part(output, bar.say)
    before, snapshot = _earlier(output, part, resume, bar.say)
    if before:
        kept = {key: getattr(settings, key) or getattr(before, key) for key in ("up", "front", "credit")}
        settings = replace(settings, **kept)
    settings = replace(settings, up=settings.up or FILES_UP.get(Path(name).suffix.lower(), DEFAULT_UP))

    def load_still(_: TrainingProgress) -> tuple[Shape, list[str]]:
        up = settings.up or DEFAULT_UP
        return load_shape(name, image, crease=crease, noise=settings.noise, up=up, thicken=thicken)

    followers: list[Callable[[Model], object]] = [partial(_hand_out, output)] if live else []
    followers += [] if follow is None else [follow]

    def finished(model: Model) -> None:
        for each in followers:
            each(model)

    progress = JsonLines(bar.say) if live else bar
    training = prepared(
        load_moving or load_still,
        settings,
        progress,
        before,
        began=began,
        part=part,
        follow=finished if followers else None,
        log=log,
        find=find,
    )
    model = training.run(before, snapshot)
    _save(model, output)
    if training.interrupted:
        by = ended_by()
        bar.say(f"stopped by {by.name if by else 'Ctrl-C'}; what is trained so far is saved; go on with --resume")
    else:
        part.remove()
    print(report(model, output))
    return model


def prepared(
    load: Loader,
    settings: Settings,
    progress: TrainingProgress,
    before: Model | None,
    *,
    began: float | None = None,
    part: Part | None = None,
    follow: Callable[[Model], object] | None = None,
    find: FindsPieces | None = None,
    log: Path | None = None,
) -> Training:
    """Load a shape, choose its levels where the user has not, and return the training of it.

    before: a model that it goes on with. log: a file for the lines of `TrainingLog`, from then on. The others are as
    of `Training`. Raises UserError.
    """
    began = time.perf_counter() if began is None else began
    where = device(settings.device)
    shape, warnings = load(progress)
    prepare(where)  # not before: of what the shape is made of, blocks as large as this keeps would leave holes
    for warning in warnings:
        progress.say(f"warning: {warning}")
    settings = chosen(shape, settings, before, progress, began)
    if log is not None:
        progress = TrainingLog(progress, log, onward=before is not None)
    return Training(shape, settings, progress, began, part, follow, find)


def _earlier(
    output: Path, part: Part, resume: bool, say: Callable[[str], None]
) -> tuple[Model | None, Snapshot | None]:
    """Return what an earlier run has left to go on with, where the user wants that: a model, and a training's state."""
    left = part.is_there()
    if left and resume:
        return part.read()
    if left:
        say(f"{show(part.path)} is of a training that was cut short; this one begins anew (--resume goes on with it)")
    return (load(output) if resume and output.exists() else None), None


def _hand_out(output: Path, model: Model) -> None:
    """Save a model to which levels are still to come: it is marked as one of a training that was interrupted."""
    save(replace(model, provenance=model.provenance | {"interrupted": True}), output)


def _save(model: Model, output: Path) -> None:
    """Save the model; where that fails after all (a full disk), save it in a new folder for temporary files.

    Raises UserError in that case, which names the file that was written.
    """
    try:
        save(model, output)
    except UserError as error:
        rescue = Path(tempfile.mkdtemp(prefix="mplicits-")) / output.name
        save(model, rescue)
        raise UserError(f"{error}; the trained model is in {show(rescue)}") from None


def report(model: Model, output: Path) -> str:
    """Describe a trained model for people: a line for each level, two for the field, and one for the file."""
    lines = [
        f"level {i}: {record['network']}, mean |f| {record['mean_f']:.2e}, "
        f"mean normal angle {record['angle']:.2f} degrees, delta {level.delta:.4f}, {record['steps']} steps"
        for i, (level, record) in enumerate(zip(model.levels, model.provenance["levels"], strict=True), start=1)
    ]
    field = model.provenance["field"]
    low, middle, high = field["gradient"]
    lines += [
        f"distance: off by {written(field['domain_error'], '.2e')} in the mean of the unit ball, "
        f"{written(field['band_error'], '.2e')} in the last level's band; too large at "
        f"{written(field['domain_excess'], '.2%')} of the ball",
        f"|grad f| on the surface: {middle:.2f} in the median, {low:.2f} to {high:.2f} for the middle 80 %",
    ]
    if noise := model.provenance["source"].get("noise"):
        lines.append(_noise(noise))
    lines.append(f"{show(output)}: {model.parameters()} parameters, {model.provenance['seconds']:.1f} s")
    return "\n".join(lines)


def _noise(record: dict[str, Any]) -> str:
    """Describe what was removed from a cloud before training: its record in the provenance."""
    known = "measured" if record["measured"] else "as given"
    return (
        f"noise: {record['deviation']:.2%} of the radius, {known}; {record['outliers']:.1%} of the points outliers; "
        "the figures above are at held-out points cleaned like the others: what cleaning got wrong they do not see"
    )
