"""The training of a shape: level after level, each frozen before the next begins, then the texture."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from ..model.errors import UserError
from ..model.model import Model
from . import hard, level, plan, quality, texture
from .last_look import FindsPieces, LastLook, Pieces
from .machine import device
from .networks.fit import Budget, Keeper, Outcome, Step, Task, TrainingProgress, fit
from .networks.network import Weights, clone
from .networks.quantized import quantized, quantized_step
from .networks.snapshot import Snapshot
from .part import Part
from .pools import Sampler
from .review import Review, aim
from .settings import Settings
from .shapes.shape import Shape
from .trained import (
    Trained,
    TrainedLevel,
    TrainedTexture,
    resumed,
    same_training,
    trained_model,
    training_record,
    unfinished_record,
)

COLOURS = 5
"""Samples of colour for each of a pool: images have more detail than shapes, and few samples are learnt by heart."""
SEEDS = 1000
"""Seeds set aside for each seed of the user: one for each level, and the last for the texture."""


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
        part: Part | None = None,
        follow: Callable[[Model], object] | None = None,
        find: FindsPieces | None = None,
    ) -> None:
        """began: the value of time.perf_counter() from which on the user's seconds count; None: now.

        part: where the training is kept every 30 s and after every level; None: nowhere. follow: receives the model
        after every level. find: finds loose pieces of a model's surface; None: nobody looks for them.
        """
        self.interrupted = False
        self._part, self._follow, self._find, self._snapshot = part, follow, find, Snapshot()
        self._shape, self._settings, self._progress = shape, settings, progress
        self._began = time.perf_counter() if began is None else began
        self._device = device(settings.device)
        self._probe = quality.SurfaceProbe(shape, self._device)
        self._field_probe = quality.FieldProbe(shape, self._device)
        self._trained = Trained()

    def run(self, resume: Model | None = None, snapshot: Snapshot | None = None) -> Model:
        """Train everything, or what the model `resume` lacks, and return the model.

        snapshot: what a `Part` holds beside the model `resume`. Where the settings are the same, training goes on in
        the middle of a level as if it had never stopped, and the user's seconds are those of all runs together.
        Raises UserError where `resume` does not fit the settings, and KeyboardInterrupt where Ctrl-C came before there
        was anything to save.
        """
        spent = 0.0
        if resume:
            self._trained = resumed(resume, self._shape, self._settings, self._device)
            if snapshot is not None and same_training(resume, self._settings):
                self._snapshot, spent = snapshot, self._trained.seconds
                self._check_time(spent)
            elif snapshot is not None:
                self._progress.say("the settings are others than before: going on with the weights alone")
        taken_over = len(self._trained.levels)
        done = self._trained.unfinished.fraction if self._trained.unfinished else 0.0
        with_texture = self._shape.colored and self._settings.texture and self._trained.texture is None
        began = self._began - spent
        budgets = plan.budgets(self._settings, taken_over, done, with_texture, began, self._field_probe.seconds)
        try:
            for index in range(taken_over, len(self._settings.networks)):
                self._train_level(index, budgets[index])
                if self.interrupted:
                    break
                self._level_finished()
            if with_texture and not self.interrupted:
                self._train_texture(budgets[-1])
        except KeyboardInterrupt:
            if len(self._trained.levels) == taken_over:
                raise
            self.interrupted = True
        return self._model()

    def _level_finished(self) -> None:
        """Keep the levels that there are, and hand them out."""
        if self._part is not None:
            self._part.write(self._model_so_far(self._trained), Snapshot())
        if self._follow is not None:
            self._follow(self._model())

    def _check_time(self, spent: float) -> None:
        """Raise UserError where nothing is left of the user's seconds, of which `spent` went before."""
        seconds = self._settings.seconds
        if seconds is not None and seconds < spent + 1:
            raise UserError(
                f"--seconds {seconds:g}: the training took {spent:.0f} s before it was cut short; give more"
            )

    def _train_level(self, index: int, budget: Budget) -> None:
        settings, network = self._settings, self._settings.networks[index]
        width, depth = network
        omega, first = settings.omegas[index], index == 0
        began, seed = time.perf_counter(), settings.seed * SEEDS + index
        self._progress.begin(f"level {index + 1} ({width}x{depth})")

        frozen, deltas = self._trained.weights(), self._trained.deltas()
        before = self._stopped_in(network)
        sampler = self._sampler(seed)
        count = plan.pool_size(budget) if before is None else before.whole("pool")
        surface, volume = sampler.surface(count), sampler.volume(count)

        start = level.start(network, omega, first=first, seed=seed, device=self._device, moving=self._shape.moving)
        unfinished, self._trained.unfinished = self._trained.unfinished, None
        if before is not None:
            budget, began = self._gone_on(budget, began, before)
        elif unfinished:
            start = partial(clone, unfinished.weights)
            budget = replace(budget, done=unfinished.fraction)
        look = LastLook(self._finder(index), self._shape, self._progress)
        budget = look.leave(budget, lambda: self._probe.seconds([*frozen, start()]))
        shape = self._shape
        weight = settings.loss_weights(first=first, noise=shape.noise, cloud=shape.cloud, moving=shape.moving)
        rate, output_factor = level.rates(width, None if first else deltas[-1])
        share = level.hard_share(first=first, exact=hard.exact(shape))
        step = level.LevelStep(surface, volume, weight, torch.Generator().manual_seed(seed), share)
        follows, late = self._reviewed(first=first)
        look_again = Review(step, sampler, surface, weight, count, follows, late, share)

        watch = self._probe.watcher(frozen)

        def figures(weights: Weights) -> dict[str, float]:
            return {"mean_f": watch(self._final(weights))} | _numbers(step.terms)

        task = Task(
            start=start,
            step=self._step(step),
            idle=level.idle_loss(surface, volume, weight),
            rate=rate,
            output_factor=output_factor,
            draws=level.LevelDraws(step, sampler),
            review=None
            if first and weight.excess <= 1
            else lambda weights, done, left: look_again(self._final(weights), done, left),
            figures=figures,
        )

        def keep(weights: Weights, snapshot: Snapshot) -> None:
            final = self._final(weights)
            record = unfinished_record(network, omega, snapshot, began)
            so_far = self._trained.and_then(final, self._probe.rough([*frozen, final]), record)
            self._keep(so_far, snapshot, network, count, began)

        outcome = fit(task, budget, self._progress, self._keeper(keep), before)
        self._progress.end()
        if first:
            self._check_first_level(outcome)

        record = training_record(network, omega, outcome, began)
        looked_at = look(f"level {index + 1}, loose pieces ({width}x{depth})", outcome, task, step, sampler)
        self.interrupted = outcome.interrupted or look.interrupted
        weights = self._final(looked_at)
        levels = [*frozen, weights]
        delta = self._probe.delta(levels)
        tracing = self._probe.tracing(levels, [*deltas, delta])
        sampled = quality.lipschitz(levels, torch.cat((surface.points, volume.points)))
        lipschitz = max(sampled, tracing.lipschitz)
        *as_bands, last = tracing.step_bounds
        self._trained.lower_band_bounds(as_bands)
        self._trained.levels.append(TrainedLevel(weights, delta, lipschitz, last, 1.0, record))

    def _reviewed(self, *, first: bool) -> tuple[float | None, bool]:
        """Return `Review.aim` and `Review.late` of a level: of a residual whose weights are not the user's."""
        shape, own = self._shape, self._settings.weights
        follows = shape.cloud and not (first or shape.moving or "length" in own)
        return aim(shape.noise) if follows else None, hard.exact(shape) and not (first or "value" in own)

    def _finder(self, index: int) -> Callable[[Weights], Pieces] | None:
        """Return what finds the loose pieces of a level's surface; None where nobody is to look for them.

        A residual alone is looked at that is the last one, of a shape that stands still and has exact distances.
        """
        find, frozen = self._find, self._trained.weights()
        exact = not (self._shape.moving or self._shape.noise)
        if find is None or not exact or not 0 < index == len(self._settings.networks) - 1:
            return None

        def pieces(weights: Weights) -> Pieces:
            final = self._final(weights)
            so_far = self._trained.and_then(final, self._probe.rough([*frozen, final]), {})
            return find(self._model_so_far(so_far))

        return pieces

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

        before = self._stopped_in(network)
        sampler = self._sampler(seed)
        count = plan.pool_size(budget) if before is None else before.whole("pool")
        surface, band = sampler.coloured(COLOURS * count), sampler.band(count)
        if before is not None:
            budget, began = self._gone_on(budget, began, before)
        step = texture.TextureStep(surface, band, torch.Generator().manual_seed(seed))
        task = Task(
            start=texture.start(network, omega, seed, self._device, moving=self._shape.moving),
            step=self._step(step),
            idle=texture.idle_loss(surface),
            rate=texture.RATE,
            output_factor=texture.OUTPUT_FACTOR,
            draws=step,
            figures=lambda _: _numbers(step.terms),
        )

        def keep(weights: Weights, snapshot: Snapshot) -> None:
            record = unfinished_record(network, omega, snapshot, began)
            so_far = replace(self._trained, texture=TrainedTexture(self._final(weights), record))
            self._keep(so_far, snapshot, network, count, began)

        outcome = fit(task, budget, self._progress, self._keeper(keep), before)
        self._progress.end()
        self.interrupted = outcome.interrupted
        weights = self._final(outcome.weights)
        self._trained.texture = TrainedTexture(weights, training_record(network, omega, outcome, began))

    def _stopped_in(self, network: tuple[int, int]) -> Snapshot | None:
        """Return the state of the stage that begins now, where the training was cut short in it; else None."""
        snapshot, self._snapshot = self._snapshot, Snapshot()
        return snapshot if snapshot.numbers.get("network") == list(network) else None

    def _gone_on(self, budget: Budget, began: float, before: Snapshot) -> tuple[Budget, float]:
        """Return the budget of a stage that is gone on with, and when it began, as if there had been no break.

        Steps count on from those that were taken. Of seconds, the budget has only those that are left.
        """
        done = before.real("fraction") if budget.steps is None else 0.0
        return replace(budget, done=done), began - before.real("seconds")

    def _keeper(self, keep: Callable[[Weights, Snapshot], None]) -> Keeper | None:
        return None if self._part is None else Keeper(self._part.due, keep)

    def _keep(self, so_far: Trained, snapshot: Snapshot, network: tuple[int, int], pool: int, began: float) -> None:
        """Write the part: `so_far` with the stage that is under way, and that stage's state.

        network: of the stage. pool: samples of its pools. began: the value of time.perf_counter() when it began.
        """
        assert self._part is not None
        stage = {"network": list(network), "pool": pool, "seconds": time.perf_counter() - began}
        self._part.write(self._model_so_far(so_far), snapshot | Snapshot(stage))

    def _sampler(self, seed: int) -> Sampler:
        trained = self._trained
        rng = np.random.default_rng(seed)
        return Sampler(self._shape, trained.weights(), trained.deltas(), self._device, rng)

    def _step(self, step: Step) -> Step:
        return quantized_step(step) if self._settings.packed else step

    def _final(self, weights: Weights) -> Weights:
        return quantized(weights) if self._settings.packed else weights

    def _model(self) -> Model:
        """Measure the levels that there are, and put the model together."""
        trained = self._trained
        return trained_model(
            trained,
            self._probe.measure(trained.weights()),
            self._field_probe.measure(trained.weights(), trained.deltas()),
            self._shape,
            self._settings,
            seconds=self._seconds(),
            interrupted=self.interrupted,
        )

    def _model_so_far(self, so_far: Trained) -> Model:
        """Put a model together without measuring anything."""
        return trained_model(so_far, None, None, self._shape, self._settings, seconds=self._seconds(), interrupted=True)

    def _seconds(self) -> float:
        return self._trained.seconds + time.perf_counter() - self._began


def _numbers(terms: dict[str, torch.Tensor]) -> dict[str, float]:
    """Fetch terms of a loss from the device."""
    return {name: term.item() for name, term in terms.items()}
