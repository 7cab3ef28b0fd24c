"""`--levels auto`: the sizes and the frequencies of the levels, chosen for a shape by short trials.

A budget of parameters, or an error that is to be reached, gives the width W of two levels, Wx1 and Wx2. Their
frequencies omega_0 are those of the trial that came nearest to the shape: smooth shapes want lower ones than shapes
with fine detail.
"""

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache

from ..model.errors import UserError
from ..model.model import Model
from .automatic_wish import NARROWEST, WIDEST, size
from .networks.fit import TrainingProgress
from .settings import OMEGA_WIDTH, OMEGAS, Settings, Wish, steps
from .shapes.shape import Shape
from .train import Training

STEP = 4
"""Between widths."""
TRIAL_STEPS = "150,350"
"""Steps of the two levels in a trial."""
FACTORS = (1.0, 0.7, 1.4)
"""On the usual omega_0 of both levels: a trial each."""
TRIALS_SHARE = 0.5
"""Of the user's seconds: after these, no further frequencies are tried."""
TRIAL_WIDTHS = (24, 56)
"""Widths of the trials that tell how the error falls with the number of parameters."""
LONGER = 0.6
"""Mean |f| after a whole training, of that after a trial of the same networks."""
LEAST_SECONDS = 120
"""The user's seconds, at least: trials take some 30 to 60 of them."""


def as_before(settings: Settings, model: Model) -> Settings:
    """Return settings whose levels are yet to be chosen with those of a model that was trained by the same wish."""
    before = model.provenance.get("settings")
    if settings.wish is None or not isinstance(before, dict) or before.get("wish") != asdict(settings.wish):
        return settings
    try:
        networks = tuple((int(width), int(depth)) for width, depth in before["networks"])
        omegas = tuple(float(omega) for omega in before["omegas"])
    except (KeyError, TypeError, ValueError):
        return settings
    return replace(settings, networks=networks, omegas=omegas, steps=steps(None, len(networks)))


def chosen(
    shape: Shape, settings: Settings, before: Model | None, progress: TrainingProgress, began: float
) -> Settings:
    """Return settings with levels: those that the user or an earlier training has chosen, or else those for the shape.

    before: the model that a training goes on with. began: as of `choose`, which says what is raised.
    """
    if settings.wish is None:
        return settings
    kept = settings if before is None else as_before(settings, before)
    return choose(shape, settings, settings.wish, progress, began) if kept is settings else kept


def choose(shape: Shape, settings: Settings, wanted: Wish, progress: TrainingProgress, began: float) -> Settings:
    """Choose the levels for a shape, say so in the log, and return the settings with them.

    Trials are trained as `settings` say, but for their length. began: the value of time.perf_counter() from which on
    the user's seconds count. Raises UserError where no width is enough or too few seconds are left, and
    KeyboardInterrupt after Ctrl-C.
    """
    if shape.moving:
        raise UserError("--levels auto: for shapes that stand still; give the levels of a motion yourself")
    if settings.seconds is not None and settings.seconds < LEAST_SECONDS:
        raise UserError(f"--levels auto: its trials need --seconds {LEAST_SECONDS} or more")
    textured = shape.colored and settings.texture

    @cache
    def trial(width: int, factor: float) -> float:
        return _trial(shape, settings, width, factor, progress)

    if wanted.error is None:
        assert wanted.parameters is not None
        width = _widest(wanted.parameters, textured)
        why = f"{wanted.parameters:,} parameters"
    else:
        widths = [(size(w, textured=False), trial(w, 1.0)) for w in TRIAL_WIDTHS]
        width, expected = _wide_enough(widths, wanted.error)
        why = f"a mean |f| of {wanted.error:g} (expected: {expected:.1e})"
    ends = math.inf if settings.seconds is None else began + TRIALS_SHARE * settings.seconds
    tried = dict[float, float]()
    for factor in FACTORS:
        if time.perf_counter() < ends:
            tried[factor] = trial(min(width, TRIAL_WIDTHS[-1]), factor)
    chosen = _with_levels(settings, width, min(tried, key=tried.__getitem__, default=1.0))
    progress.say(f"levels: {width}x1,{width}x2, for {why}")
    of_trials = ", ".join(f"{error:.1e} with {factor:g} times" for factor, error in tried.items())
    why = (
        f"mean |f| of trials: {of_trials} the usual ones"
        if tried
        else "the usual ones: no seconds were left to try others"
    )
    progress.say(f"omega: {_shown(chosen.omegas)}; {why}")
    return chosen


def _shown(omegas: tuple[float, ...]) -> str:
    return ", ".join(f"{omega:g}" for omega in omegas)


def _widest(parameters: int, textured: bool) -> int:
    """Return the largest width whose model has at most so many parameters."""
    widths = [w for w in range(NARROWEST, WIDEST + 1, STEP) if size(w, textured=textured) <= parameters]
    if not widths:
        least = size(NARROWEST, textured=textured)
        raise UserError(
            f"--levels auto: {parameters:,} parameters; with its colours this shape needs {least:,} or more"
        )
    return widths[-1]


def _wide_enough(trials: list[tuple[int, float]], error: float) -> tuple[int, float]:
    """Return the least width that is expected to reach an error, and the error that is expected of it.

    trials: (parameters, mean |f|) of two sizes; the error is taken to fall with a power of the parameters.
    Raises UserError where the largest width is not expected to reach it.
    """
    (few, rough), (many, fine) = trials
    power = max(0.1, math.log(rough / max(fine, 1e-9)) / math.log(many / few))

    def expected(width: int) -> float:
        return float(LONGER * fine * (size(width, textured=False) / many) ** -power)

    for width in range(NARROWEST, WIDEST + 1, STEP):
        if expected(width) <= error:
            return width, expected(width)
    raise UserError(
        f"--error {error:g}: not even {WIDEST}x1,{WIDEST}x2 is expected to reach it ({expected(WIDEST):.1e})"
    )


def _trial(shape: Shape, settings: Settings, width: int, factor: float, progress: TrainingProgress) -> float:
    """Train levels shortly and return their mean |f| on held-out points of the surface.

    Raises KeyboardInterrupt after Ctrl-C.
    """
    levels = _with_levels(settings, width, factor)
    short = replace(levels, steps=steps(TRIAL_STEPS, 2), seconds=None, texture=False)
    training = Training(shape, short, _Trial(progress, _shown(levels.omegas)))
    model = training.run()
    if training.interrupted:
        raise KeyboardInterrupt
    return float(model.provenance["levels"][-1]["mean_f"])


class _Trial:
    """A `TrainingProgress` of a trial, which logs nothing of its own."""

    def __init__(self, progress: TrainingProgress, omegas: str) -> None:
        self._progress, self._omegas = progress, omegas

    def begin(self, stage: str) -> None:
        self._progress.begin(f"trial of omega {self._omegas}: {stage}")

    def advance(self, fraction: float, loss: float) -> None:
        self._progress.advance(fraction, loss)

    def tell(self, step: int, figures: Mapping[str, float]) -> None:
        self._progress.tell(step, figures)

    def end(self) -> None:
        self._progress.end()

    def say(self, line: str) -> None:
        """Keep to oneself that a level of a trial was restarted, or failed."""


def _with_levels(settings: Settings, width: int, factor: float) -> Settings:
    scale = factor * min(1.0, math.sqrt(width / OMEGA_WIDTH))
    omegas = tuple(round(omega * scale, 1) for omega in OMEGAS[:2])
    return replace(settings, networks=((width, 1), (width, 2)), omegas=omegas, steps=steps(None, 2))
