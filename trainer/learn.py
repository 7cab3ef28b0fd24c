"""Trainings from a program: the options of `train` and `morph`, shapes in files or in memory, and no file written."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Unpack

from ..model.errors import UserError
from ..model.model import Model
from ..model.orientation import DEFAULT_UP, FILES_UP
from .last_look import FindsPieces
from .motion import ModelSurface, end_called, frames, frames_loader, morph_loader
from .networks.fit import TrainingProgress
from .options import CREASE, TrainingOptions, check_no_image, settings_from, shows_options
from .session import Loader, TrainingBar, prepared
from .settings import Settings
from .shapes.arrays import Arrays
from .shapes.load import load_shape
from .shapes.shape import Shape

Callback = Callable[[str, float, float], object]
"""Is told the stage ("level 1 (64x1)"), the share of it that is done, in [0, 1], and a recent mean of the loss."""


class _Told:
    """A `TrainingProgress` that passes everything on, and tells a callback."""

    def __init__(self, progress: TrainingProgress, callback: Callback) -> None:
        self._progress, self._callback, self._stage = progress, callback, ""

    def begin(self, stage: str) -> None:
        self._stage = stage
        self._progress.begin(stage)

    def advance(self, fraction: float, loss: float) -> None:
        self._progress.advance(fraction, loss)
        self._callback(self._stage, fraction, loss)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        self._progress.tell(step, figures)

    def end(self) -> None:
        self._progress.end()

    def say(self, line: str) -> None:
        self._progress.say(line)


@shows_options(settings_from)
def learn(
    shape: str | Path | Arrays,
    levels: str | Sequence[str] | None = None,
    *,
    time: bool = False,
    flat: bool = False,
    quiet: bool = False,
    resume: Model | None = None,
    callback: Callback | None = None,
    follow: Callable[[Model], object] | None = None,
    log: str | Path | None = None,
    find: FindsPieces | None = None,
    **options: Unpack[TrainingOptions],
) -> Model:
    """Train a model of a shape.

    shape: a path, the word "demo", or what `Arrays` says; with `time`, a folder of meshes, which are moments of one
    motion. The options are those of `mplicits train` (docs/training.md), with their names and defaults; resume: a model
    to go on with. callback: is told of the progress; where it raises KeyboardInterrupt the training ends with what is
    trained so far. follow: receives the model after each level. log: a file for the lines of `TrainingLog`.
    find: as of `Training`. Raises UserError.
    """
    settings = settings_from(levels, **options)
    crease = None if flat else options.get("crease", CREASE)
    texture, thicken = options.get("texture", "auto"), options.get("thicken")
    load: Loader
    if time:
        if not isinstance(shape, (str, Path)):
            raise UserError("time: the path of a folder of meshes is needed")
        load = frames_loader(Path(shape), frames(Path(shape)), up=settings.up, crease=crease)
    elif isinstance(shape, (str, Path)):
        name = str(shape)
        settings = replace(settings, up=settings.up or FILES_UP.get(Path(name).suffix.lower(), DEFAULT_UP))
        image = None if texture in ("auto", "none") else Path(texture)

        def load(_: TrainingProgress) -> tuple[Shape, list[str]]:
            up = settings.up or DEFAULT_UP
            return load_shape(name, image, crease=crease, noise=settings.noise, up=up, thicken=thicken)
    else:

        def load(_: TrainingProgress) -> tuple[Shape, list[str]]:
            up = settings.up or DEFAULT_UP
            return load_shape(shape, crease=crease, noise=settings.noise, up=up, thicken=thicken)

    return _trained(load, settings, quiet, resume, callback, follow, log, find)


@shows_options(settings_from)
def morph(
    first: str | Path | Model,
    second: str | Path | Model,
    surface_of: Callable[[Model], ModelSurface],
    levels: str | Sequence[str] | None = None,
    *,
    in_place: bool = False,
    flat: bool = False,
    quiet: bool = False,
    resume: Model | None = None,
    callback: Callback | None = None,
    follow: Callable[[Model], object] | None = None,
    log: str | Path | None = None,
    **options: Unpack[TrainingOptions],
) -> Model:
    """Train a model that is one shape at t = 0 and another at t = 1.

    first, second: models, or what `mplicits morph` takes. surface_of: extracts the surface of a model. The others are
    those of `learn`; the options, of `mplicits morph`. Raises UserError.
    """
    check_no_image(options.get("texture", "auto"))
    settings = settings_from(levels, **options)
    ends = [end if isinstance(end, Model) else end_called(str(end)) for end in (first, second)]
    crease = None if flat else options.get("crease", CREASE)
    load = morph_loader(ends, surface_of, in_place=in_place, up=settings.up, crease=crease)
    return _trained(load, settings, quiet, resume, callback, follow, log)


def _trained(
    load: Loader,
    settings: Settings,
    quiet: bool,
    resume: Model | None,
    callback: Callback | None,
    follow: Callable[[Model], object] | None,
    log: str | Path | None,
    find: FindsPieces | None = None,
) -> Model:
    """Load a shape and train a model of it, without a file."""
    bar = TrainingBar(quiet)
    progress = bar if callback is None else _Told(bar, callback)
    settings = replace(settings, up=settings.up or DEFAULT_UP)
    file = None if log is None else Path(log)
    return prepared(load, settings, progress, resume, follow=follow, log=file, find=find).run(resume)
