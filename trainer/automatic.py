"""`--levels auto`: short trials choose the sizes and the frequencies of the levels for a shape.

A number of parameters, or an error to reach, gives the width W of two levels, Wx1 and Wx2. Their frequencies omega_0
are the best trial's: smooth shapes need lower frequencies than shapes with fine detail.
"""

import math
import time
from dataclasses import asdict, replace
from functools import cache

from ..model.errors import UserError
from ..model.model import Model
from .config import TrainingConfig, default_config
from .level_goal import NARROWEST, WIDEST, parameters_of_width
from .networks.callback import TrainingProgress
from .progress import ForwardingProgress
from .settings import LevelGoal, Settings, default_omega, steps
from .shapes.shape import Shape
from .train import Training


def with_levels(
    shape: Shape, settings: Settings, previous: Model | None, progress: TrainingProgress, began: float
) -> Settings:
    """Return settings with levels: the user's, those of the model `previous`, or those chosen for the shape.

    previous: the model that the training resumes. began: as in `choose_levels`, which raises the same errors.
    """
    if settings.wish is None:
        return settings
    resumed = settings if previous is None else with_previous_levels(settings, previous)
    return choose_levels(shape, settings, settings.wish, progress, began) if resumed is settings else resumed


def with_previous_levels(settings: Settings, model: Model) -> Settings:
    """Return settings with the levels of a model that was trained for the same goal; else the same settings."""
    trained = model.provenance.get("settings")
    if settings.wish is None or not isinstance(trained, dict) or trained.get("wish") != asdict(settings.wish):
        return settings
    try:
        networks = tuple((int(width), int(depth)) for width, depth in trained["networks"])
        omegas = tuple(float(omega) for omega in trained["omegas"])
    except (KeyError, TypeError, ValueError):
        return settings
    return replace(settings, networks=networks, omegas=omegas, steps=steps(None, len(networks)))


def choose_levels(
    shape: Shape, settings: Settings, goal: LevelGoal, progress: TrainingProgress, began: float
) -> Settings:
    """Choose the levels for a shape, say so in the log, and return the settings with them.

    Trials follow `settings` except for their length. began: value of time.perf_counter() from which the user's seconds
    count. Raises UserError where no width is enough or too few seconds are left, and KeyboardInterrupt after Ctrl-C.
    """
    config = default_config()
    automatic = config.automatic
    if shape.moving:
        raise UserError("--levels auto: not for shapes that move; name their levels: --levels 64x1,64x2")
    if settings.seconds is not None and settings.seconds < automatic.least_seconds:
        raise UserError(f"--levels auto: its trials need --seconds {automatic.least_seconds:g} or more")
    textured = shape.colored and settings.texture

    @cache
    def trial(width: int, factor: float) -> float:
        return _trial(shape, settings, width, factor, progress, config)

    if goal.error is None:
        assert goal.parameters is not None
        width = _largest_width(goal.parameters, textured, automatic.width_step)
        why = f"{goal.parameters:,} parameters"
    else:
        trials = [(parameters_of_width(w, textured=False), trial(w, 1.0)) for w in automatic.trial_widths]
        width, expected = _width_for_error(trials, goal.error, config)
        why = f"a mean |f| of {goal.error:g} (expected: {expected:.1e})"
    ends = math.inf if settings.seconds is None else began + automatic.trials_share * settings.seconds
    tried = dict[float, float]()
    for factor in automatic.factors:
        if time.perf_counter() < ends:
            tried[factor] = trial(min(width, automatic.trial_widths[-1]), factor)
    chosen = _settings_of(settings, width, min(tried, key=tried.__getitem__, default=1.0))
    progress.say(f"levels: {width}x1,{width}x2, for {why}")
    errors = ", ".join(f"{error:.1e} with {factor:g} times" for factor, error in tried.items())
    why = f"mean |f| of trials: {errors} the default" if tried else "the default: no seconds were left for trials"
    progress.say(f"omega: {_listed(chosen.omegas)}; {why}")
    return chosen


def _listed(omegas: tuple[float, ...]) -> str:
    return ", ".join(f"{omega:g}" for omega in omegas)


def _largest_width(parameters: int, textured: bool, step: int) -> int:
    """Return the largest width whose model has at most this number of parameters."""
    widths = [w for w in range(NARROWEST, WIDEST + 1, step) if parameters_of_width(w, textured=textured) <= parameters]
    if not widths:
        least = parameters_of_width(NARROWEST, textured=textured)
        raise UserError(f"--levels auto: {parameters:,} parameters; with its colors this shape needs {least:,} or more")
    return widths[-1]


def _width_for_error(trials: list[tuple[int, float]], error: float, config: TrainingConfig) -> tuple[int, float]:
    """Return the least width that is expected to reach an error, and its expected error.

    trials: (parameters, mean |f|) of two sizes. The error is assumed to fall with a power of the parameters.
    Raises UserError where the largest width is not expected to reach it.
    """
    (few, rough), (many, fine) = trials
    power = max(0.1, math.log(rough / max(fine, 1e-9)) / math.log(many / few))

    def expected(width: int) -> float:
        ratio = parameters_of_width(width, textured=False) / many
        return float(config.automatic.improvement * fine * ratio**-power)

    for width in range(NARROWEST, WIDEST + 1, config.automatic.width_step):
        if expected(width) <= error:
            return width, expected(width)
    raise UserError(
        f"--error {error:g}: not even {WIDEST}x1,{WIDEST}x2 is expected to reach it ({expected(WIDEST):.1e})"
    )


def _trial(
    shape: Shape, settings: Settings, width: int, factor: float, progress: TrainingProgress, config: TrainingConfig
) -> float:
    """Train levels briefly and return their mean |f| at held-out points.

    Raises KeyboardInterrupt after Ctrl-C.
    """
    levels = _settings_of(settings, width, factor)
    first, second = config.automatic.trial_steps
    brief = replace(levels, steps=(first, second, second), seconds=None, texture=False)
    training = Training(shape, brief, _TrialProgress(progress, _listed(levels.omegas)), config=config)
    model = training.run()
    if training.interrupted:
        raise KeyboardInterrupt
    return float(model.provenance["levels"][-1]["mean_f"])


class _TrialProgress(ForwardingProgress):
    """The progress of a trial, without log lines."""

    def __init__(self, progress: TrainingProgress, omegas: str) -> None:
        super().__init__(progress)
        self._omegas = omegas

    def begin(self, stage: str) -> None:
        super().begin(f"trial of omega {self._omegas}: {stage}")

    def say(self, line: str) -> None:
        """Drop the line: a restart in a trial concerns nobody."""


def _settings_of(settings: Settings, width: int, factor: float) -> Settings:
    omegas = tuple(default_omega(index, width, factor) for index in (0, 1))
    return replace(settings, networks=((width, 1), (width, 2)), omegas=omegas, steps=steps(None, 2))
