"""The training of a shape: level after level, each frozen before the next begins, then the texture."""

import time
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from ..model.errors import UserError
from ..model.model import Model
from . import level, plan, quality, texture
from .machine import device
from .networks.fit import Budget, Outcome, Step, Task, TrainingProgress, fit
from .networks.network import Weights, clone
from .networks.quantised import quantised, quantised_step
from .pools import Sampler
from .settings import Settings
from .shapes.shape import Shape
from .trained import Trained, TrainedLevel, TrainedTexture, resumed, trained_model, training_record

COLOURS = 5
"""Samples of colour for each of a pool: images have more detail than shapes, and few samples are learnt by heart."""
SEEDS = 1000
"""Seeds set aside for each seed of the user: one for each level, and the last for the texture."""


class Training:
    """One training of a shape."""

    interrupted: bool
    """Whether Ctrl-C ended the training; known after `run`."""

    def __init__(
        self, shape: Shape, settings: Settings, progress: TrainingProgress, began: float | None = None
    ) -> None:
        """began: the value of time.perf_counter() from which on the user's seconds count; None: now."""
        self.interrupted = False
        self._shape, self._settings, self._progress = shape, settings, progress
        self._began = time.perf_counter() if began is None else began
        self._device = device(settings.device)
        self._probe = quality.SurfaceProbe(shape, self._device)
        self._field_probe = quality.FieldProbe(shape, self._device)
        self._trained = Trained()

    def run(self, resume: Model | None = None) -> Model:
        """Train everything, or what the model `resume` lacks, and return the model.

        Raises UserError where `resume` does not fit the settings, and KeyboardInterrupt where Ctrl-C came before there
        was anything to save.
        """
        if resume:
            self._trained = resumed(resume, self._shape, self._settings, self._device)
        taken_over = len(self._trained.levels)
        with_texture = self._shape.coloured and self._settings.texture and self._trained.texture is None
        budgets = plan.budgets(self._settings, taken_over, with_texture, self._began, self._field_probe.seconds)
        try:
            for index in range(taken_over, len(self._settings.networks)):
                self._train_level(index, budgets[index])
                self._level_finished()
                if self.interrupted:
                    break
            if with_texture and not self.interrupted:
                self._train_texture(budgets[-1])
        except KeyboardInterrupt:
            if len(self._trained.levels) == taken_over:
                raise
            self.interrupted = True
        return self._model()

    def _level_finished(self) -> None:
        """Do nothing; subclasses may save the levels that there are."""

    def _train_level(self, index: int, budget: Budget) -> None:
        settings, network = self._settings, self._settings.networks[index]
        width, depth = network
        omega, first = settings.omegas[index], index == 0
        began, seed = time.perf_counter(), settings.seed * SEEDS + index
        self._progress.begin(f"level {index + 1} ({width}x{depth})")

        frozen, deltas = self._trained.weights(), self._trained.deltas()
        sampler = self._sampler(seed)
        count = plan.pool_size(budget)
        surface, volume = sampler.surface(count), sampler.volume(count)

        start = level.start(network, omega, first=first, seed=seed, device=self._device)
        unfinished, self._trained.unfinished = self._trained.unfinished, None
        if unfinished:
            start = partial(clone, unfinished.weights)
            budget = replace(budget, done=unfinished.fraction)
        if budget.steps is None:
            budget = replace(budget, deadline=budget.deadline - self._probe.seconds([*frozen, start()]))
        weight = settings.loss_weights(first=first, noise=self._shape.noise)
        rate, output_factor = level.rates(width, None if first else deltas[-1])
        step = level.LevelStep(surface, volume, weight, torch.Generator().manual_seed(seed))

        def review(weights: Weights) -> None:
            step.hard = sampler.hard(self._final(weights), step.hard, count)

        task = Task(
            start=start,
            step=self._step(step),
            idle=level.idle_loss(surface, volume, weight),
            rate=rate,
            output_factor=output_factor,
            review=None if first else review,
        )
        outcome = fit(task, budget, self._progress)
        self._progress.end()
        if first:
            self._check_first_level(outcome)
        self.interrupted = outcome.interrupted

        record = training_record(network, omega, outcome, began)
        weights = self._final(outcome.weights)
        levels = [*frozen, weights]
        delta = self._probe.delta(levels)
        tracing = self._probe.tracing(levels, [*deltas, delta])
        sampled = quality.lipschitz(levels, torch.cat((surface.points, volume.points)))
        lipschitz = max(sampled, tracing.lipschitz)
        *as_bands, last = tracing.step_bounds
        self._trained.lower_band_bounds(as_bands)
        self._trained.levels.append(TrainedLevel(weights, delta, lipschitz, last, 1.0, record))

    def _check_first_level(self, outcome: Outcome) -> None:
        """Raise UserError where level 1 is no model of the shape: it failed, or had no time for a step."""
        settings = self._settings
        width, depth = settings.networks[0]
        if outcome.failed:
            raise UserError(f"level 1 ({width}x{depth}) learnt nothing of the shape; try another --omega or --weights")
        if not (outcome.steps or outcome.interrupted):
            raise UserError(f"--seconds {settings.seconds:g}: no time was left for a step of level 1; give more")

    def _train_texture(self, budget: Budget) -> None:
        settings = self._settings
        network, omega = settings.texture_size(), settings.texture_omega()
        width, depth = network
        began, seed = time.perf_counter(), settings.seed * SEEDS + SEEDS - 1
        self._progress.begin(f"texture ({width}x{depth})")

        sampler = self._sampler(seed)
        count = plan.pool_size(budget)
        surface, band = sampler.coloured(COLOURS * count), sampler.band(count)
        task = Task(
            start=texture.start(network, omega, seed, self._device),
            step=self._step(texture.step(surface, band, torch.Generator().manual_seed(seed))),
            idle=texture.idle_loss(surface),
            rate=texture.RATE,
            output_factor=texture.OUTPUT_FACTOR,
        )
        outcome = fit(task, budget, self._progress)
        self._progress.end()
        self.interrupted = outcome.interrupted
        weights = self._final(outcome.weights)
        self._trained.texture = TrainedTexture(weights, training_record(network, omega, outcome, began))

    def _sampler(self, seed: int) -> Sampler:
        trained = self._trained
        rng = np.random.default_rng(seed)
        return Sampler(self._shape, trained.weights(), trained.deltas(), self._device, rng)

    def _step(self, step: Step) -> Step:
        return quantised_step(step) if self._settings.packed else step

    def _final(self, weights: Weights) -> Weights:
        return quantised(weights) if self._settings.packed else weights

    def _model(self) -> Model:
        """Measure the levels that there are, and put the model together."""
        trained = self._trained
        return trained_model(
            trained,
            self._probe.measure(trained.weights()),
            self._field_probe.measure(trained.weights(), trained.deltas()),
            self._shape,
            self._settings,
            seconds=trained.seconds + time.perf_counter() - self._began,
            interrupted=self.interrupted,
        )
