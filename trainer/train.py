"""The training of a shape: level after level, each frozen before the next begins, then the texture."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.interrupts import SecondInterrupt
from ..model.model import Model
from . import plan
from .callbacks import Checkpoint
from .checkpoint import CheckpointFile
from .config import TrainingConfig, default_config
from .finished_networks import (
    Trained,
    TrainedTexture,
    resumed,
    same_training,
    trained_model,
    training_record,
    unfinished_record,
)
from .frozen_levels import FrozenLevels
from .level import initial_level
from .level_training import LevelTraining
from .machine import device
from .measures import Measures
from .networks.callback import Callback, FitState, Report, TrainingProgress
from .networks.fit import Budget, Outcome, Step, Task, fit
from .networks.network import Weights, clone
from .networks.quantized import quantized, quantized_step
from .networks.snapshot import Snapshot
from .pace import Pace
from .settings import Settings
from .shapes.shape import Doubles, Shape
from .stage import Stage, begin
from .texture_training import TextureTraining

SEEDS = 1000
"""Seeds reserved for each seed of the user: one for each level, and the last for the texture."""

ComponentsOfModel = Callable[[Model], NDArray[np.float32]]
"""Returns the vertices (N, 3) of the loose components of a model's surface, model space."""


class Training:
    """One training of a shape."""

    interrupted: bool
    """Whether Ctrl-C ended the training; known after `run`."""

    def __init__(
        self,
        shape: Shape,
        settings: Settings,
        progress: TrainingProgress,
        began: float | None = None,
        part: CheckpointFile | None = None,
        callbacks: Sequence[Callback] = (),
        config: TrainingConfig | None = None,
        components: ComponentsOfModel | None = None,
    ) -> None:
        """began: value of time.perf_counter() from which the user's seconds count; None: now.

        part: file for checkpoints. callbacks: run during the training of every level and of the texture. components:
        finds the loose components of a model's surface, which late steps of the last level remove.
        """
        self._components = components
        self.interrupted = False
        self._shape, self._settings, self._progress = shape, settings, progress
        self._config = default_config() if config is None else config
        self._part, self._callbacks, self._snapshot = part, callbacks, Snapshot()
        self._began = time.perf_counter() if began is None else began
        self._device = device(settings.device)
        self._measures = Measures(shape, self._device, self._config.measuring)
        self._trained = Trained()

    def run(self, resume: Model | None = None, snapshot: Snapshot | None = None) -> Model:
        """Train all levels, or the levels that the model `resume` lacks, and return the model.

        snapshot: the state that a `CheckpointFile` has beside the model `resume`. With the same settings, training
        resumes in the middle of a level as if it had never stopped, and the user's seconds count all runs.
        Raises UserError where `resume` does not fit the settings, and KeyboardInterrupt where Ctrl-C came before there
        was anything to save.
        """
        spent = 0.0
        if resume:
            self._trained = resumed(resume, self._shape, self._settings, self._device)
            if snapshot is not None and same_training(resume, self._settings):
                self._snapshot, spent = snapshot, self._trained.seconds
                plan.check_time(self._settings, spent)
            elif snapshot is not None:
                self._progress.say("the settings differ from the interrupted run's: only its weights are used")
        finished = len(self._trained.levels)
        measuring = 0.0 if self._settings.seconds is None else self._measuring_seconds()
        done = self._trained.unfinished.fraction if self._trained.unfinished else 0.0
        with_texture = self._shape.colored and self._settings.texture and self._trained.texture is None
        config, began = self._config.budget, self._began
        budgets = plan.budgets(self._settings, finished, done, with_texture, began, measuring, config, spent)
        try:
            for index in range(finished, len(self._settings.networks)):
                self._train_level(index, budgets[index])
                if self.interrupted:
                    break
                self._after_level()
            if with_texture and not self.interrupted:
                self._train_texture(budgets[-1])
        except SecondInterrupt:
            raise
        except KeyboardInterrupt:
            if self.interrupted or len(self._trained.levels) == finished:
                raise
            self.interrupted = True
        return self._model()

    def _measuring_seconds(self) -> float:
        """Estimate the seconds of measuring the finished model."""
        settings, config, moving = self._settings, self._config.step, self._shape.moving
        initial = partial(initial_level, seed=settings.seed, device=self._device, moving=moving, config=config)
        sizes = zip(settings.networks, settings.omegas, strict=False)
        return self._measures.seconds([initial(*size, first=i == 0) for i, size in enumerate(sizes)])

    def _train_level(self, index: int, budget: Budget) -> None:
        """Train the level after the finished ones, measure it and freeze it."""
        settings = self._settings
        stage = self._begin(f"level {index + 1}", settings.networks[index], settings.omegas[index], index, budget)
        level = LevelTraining(self._shape, settings, self._config, self._frozen_levels(), stage)
        start, budget, measuring = self._start(stage, level)
        frozen = self._trained.weights()
        watch = self._measures.surface.watcher(frozen)

        def figures(weights: Weights) -> dict[str, float]:
            return {"mean_f": watch(self._final(weights))} | level.step.terms

        def so_far(weights: Weights, record: dict[str, object]) -> Trained:
            return self._trained.and_then(weights, self._measures.surface.rough([*frozen, weights]), record)

        seconds = self._config.mining.component_cost * measuring
        task = level.task(start, self._step(level.step))
        callbacks = level.callbacks(self._component_search(index, so_far), seconds)
        outcome, record = self._fit(stage, budget, task, callbacks, figures, so_far)
        if index == 0:
            self._check_first_level(outcome)
        self._measures.freeze(self._trained, self._final(outcome.weights), level.points(), record)

    def _component_search(
        self, index: int, so_far: Callable[[Weights, dict[str, object]], Trained]
    ) -> Callable[[Weights], Doubles] | None:
        """Return the search for loose components: for the last level, a residual, of a shape with exact distances."""
        find, shape = self._components, self._shape
        last = 0 < index == len(self._settings.networks) - 1
        if find is None or not last or shape.moving or shape.noise:
            return None
        return lambda weights: find(self._unmeasured_model(so_far(self._final(weights), {}))).astype(np.float64)

    def _start(self, stage: Stage, level: LevelTraining) -> tuple[Callable[[], Weights], Budget, float]:
        """Return what makes the level's first weights, the budget of its steps, and the seconds of measuring it."""
        start, budget = level.initial, stage.budget
        unfinished, self._trained.unfinished = self._trained.unfinished, None
        if unfinished and stage.resume is None:
            start, budget = partial(clone, unfinished.weights), replace(budget, done=unfinished.fraction)
        seconds = 0.0
        if budget.steps is None:
            seconds = self._measures.surface.seconds([*self._trained.weights(), start()])
            budget = replace(budget, deadline=budget.deadline - seconds)
        return start, budget, seconds

    def _check_first_level(self, outcome: Outcome) -> None:
        """Raise UserError where level 1 is no model of the shape: it failed, or had no time for a step."""
        settings = self._settings
        width, depth = settings.networks[0]
        if outcome.failed:
            raise UserError(f"level 1 ({width}x{depth}) learnt nothing of the shape; try another --omega or --weights")
        if not (outcome.steps or outcome.interrupted):
            raise UserError(f"--seconds {settings.seconds:g}: no time was left for a step of level 1; give more")

    def _after_level(self) -> None:
        if self._part is not None:
            self._part.write(self._unmeasured_model(self._trained), Snapshot())
        for callback in self._callbacks:
            callback.after_level(self._model)

    def _train_texture(self, budget: Budget) -> None:
        settings = self._settings
        stage = self._begin("texture", settings.texture_size(), settings.texture_omega(), SEEDS - 1, budget)
        texture = TextureTraining(self._shape, self._config.texture, self._frozen_levels(), stage)
        if line := texture.blurred():
            self._progress.say(f"warning: {line}")

        def so_far(weights: Weights, record: dict[str, object]) -> Trained:
            return replace(self._trained, texture=TrainedTexture(weights, record))

        task = texture.task(self._step(texture.step))
        outcome, record = self._fit(stage, stage.budget, task, [], lambda _: texture.step.terms, so_far)
        self._trained.texture = TrainedTexture(self._final(outcome.weights), record)

    def _begin(self, name: str, network: tuple[int, int], omega: float, seed: int, budget: Budget) -> Stage:
        """Begin a stage, or continue the stage in which a training was interrupted. seed: below `SEEDS`."""
        snapshot, self._snapshot = self._snapshot, Snapshot()
        stage = begin(name, network, omega, self._settings.seed * SEEDS + seed, budget, snapshot, self._config)
        self._progress.begin(f"{name} ({stage.size})")
        return stage

    def _fit(
        self,
        stage: Stage,
        budget: Budget,
        task: Task,
        callbacks: Sequence[Callback],
        figures: Callable[[Weights], Mapping[str, float]],
        so_far: Callable[[Weights, dict[str, object]], Trained],
    ) -> tuple[Outcome, dict[str, Any]]:
        """Train the stage's network. Returns the outcome, and its record for the provenance.

        so_far: adds the unfinished network, and its record, to the finished ones.
        """
        pace = Pace()

        def write(state: FitState) -> None:
            assert self._part is not None
            snapshot = state.snapshot()
            record = unfinished_record(stage.size, stage.omega, snapshot, stage.began)
            model = self._unmeasured_model(so_far(self._final(state.weights), record))
            self._part.write(model, snapshot | stage.checkpoint())

        every = [*callbacks, *self._callbacks, Report(self._progress, figures)]
        if self._part is not None:
            every.append(Checkpoint(self._part, write))
        budget = plan.prepared(budget, self._config.budget)
        outcome = fit(task, budget, self._progress.say, [*every, pace], stage.resume)
        self._progress.end()
        self.interrupted = outcome.interrupted
        record = training_record(stage.size, stage.omega, outcome, stage.began)
        return outcome, record | pace.record(outcome.steps, budget.seconds)

    def _frozen_levels(self) -> FrozenLevels:
        trained = self._trained
        return FrozenLevels(trained.weights(), trained.deltas(), self._device, self._config.sampling)

    def _step(self, step: Step) -> Step:
        return quantized_step(step) if self._settings.packed else step

    def _final(self, weights: Weights) -> Weights:
        return quantized(weights) if self._settings.packed else weights

    def _model(self) -> Model:
        """Measure the finished levels, and return the model of them."""
        figures, seconds = self._measures.figures(self._trained), self._seconds()
        return trained_model(
            self._trained, *figures, self._shape, self._settings, seconds=seconds, interrupted=self.interrupted
        )

    def _unmeasured_model(self, trained: Trained) -> Model:
        seconds = self._seconds()
        return trained_model(trained, None, None, None, self._shape, self._settings, seconds=seconds, interrupted=True)

    def _seconds(self) -> float:
        """Return the seconds of all runs of this training."""
        return self._trained.seconds + time.perf_counter() - self._began
