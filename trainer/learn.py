"""A training from a program: the options of the verb `train`, a shape in a file or in memory, and no file written."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ..model.model import Model
from ..model.orientation import DEFAULT_UP, FILES_UP
from .machine import device as device_called
from .machine import prepare
from .networks.fit import TrainingProgress
from .options import CREASE, Numbers, settings_from
from .session import TrainingBar
from .settings import DEFAULT_PRESET
from .shapes.given import Given, given_shape
from .shapes.load import load_shape
from .train import Training

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

    def end(self) -> None:
        self._progress.end()

    def say(self, line: str) -> None:
        self._progress.say(line)


def learn(
    shape: str | Path | Given,
    levels: str | Sequence[str] | None = None,
    preset: str = DEFAULT_PRESET,
    packed: bool = False,
    omega: Numbers | None = None,
    seconds: float | None = None,
    steps: Numbers | None = None,
    texture: str = "auto",
    texture_network: str | None = None,
    crease: float = CREASE,
    flat: bool = False,
    thicken: float | None = None,
    noise: float | None = None,
    up: str | None = None,
    front: Numbers | None = None,
    credit: str | None = None,
    seed: int = 0,
    device: str = "auto",
    weights: str | Mapping[str, float] | None = None,
    quiet: bool = False,
    resume: Model | None = None,
    callback: Callback | None = None,
    follow: Callable[[Model], object] | None = None,
) -> Model:
    """Train a model of a shape.

    shape: a path, the word "demo", or what `Given` says. The options are those of `mplicits train`
    (docs/training.md), with their names and defaults; resume: a model to go on with. callback: is told of the
    progress; where it raises KeyboardInterrupt the training ends with what is trained so far. follow: receives the
    model after each level. Raises UserError.
    """
    settings = settings_from(
        levels=levels,
        preset=preset,
        packed=packed,
        omega=omega,
        seconds=seconds,
        steps=steps,
        texture=texture,
        texture_network=texture_network,
        crease=crease,
        thicken=thicken,
        noise=noise,
        up=up,
        front=front,
        credit=credit,
        seed=seed,
        device=device,
        weights=weights,
    )
    prepare(device_called(settings.device))
    bent = None if flat else crease
    if isinstance(shape, (str, Path)):
        name = str(shape)
        upwards = settings.up or FILES_UP.get(Path(name).suffix.lower(), DEFAULT_UP)
        image = None if texture in ("auto", "none") else Path(texture)
        loaded, warnings = load_shape(name, image, crease=bent, noise=noise, up=upwards, thicken=thicken)
    else:
        upwards = settings.up or DEFAULT_UP
        loaded, warnings = given_shape(shape, crease=bent, noise=noise, up=upwards, thicken=thicken)
    bar = TrainingBar(quiet)
    for warning in warnings:
        bar.say(f"warning: {warning}")
    progress: TrainingProgress = bar if callback is None else _Told(bar, callback)
    settings = replace(settings, up=upwards)
    return Training(loaded, settings, progress, follow=follow).run(resume)
