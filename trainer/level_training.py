"""The training of one level: its samples, its optimizer step, and the callbacks beside the steps."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from . import level
from .callbacks import ComponentsOfLevel, FollowSurfaceEikonal, MineHardExamples, RaiseLateValue
from .config import LossWeights, TrainingConfig
from .frozen_levels import FrozenLevels
from .level import LevelState, LevelStep
from .mining import Miner, exact_distances
from .networks.callback import Callback
from .networks.fit import Step, Task
from .networks.network import Weights
from .settings import Settings
from .shapes.shape import Shape
from .stage import Stage
from .training_samples import Sampler


class LevelTraining:
    """The training of one level f_i = f_{i-1} + r; f_0 = 0."""

    def __init__(
        self, shape: Shape, settings: Settings, config: TrainingConfig, frozen: FrozenLevels, stage: Stage
    ) -> None:
        """frozen: the levels before."""
        self._shape, self._settings, self._config, self._frozen, self._stage = shape, settings, config, frozen, stage
        self._first, self._exact = not frozen.levels, exact_distances(shape)
        rng = np.random.default_rng(stage.seed)
        self._sampler, self._miner = Sampler(shape, frozen, rng), Miner(shape, frozen, rng, config.mining)
        self._surface, self._volume = self._sampler.surface(stage.samples), self._sampler.volume(stage.samples)
        self._hard_share = level.hard_share(config.mining, first=self._first, exact=self._exact)
        self.step = LevelStep(
            self._surface,
            self._volume,
            self._loss_weights(),
            torch.Generator().manual_seed(stage.seed),
            self._hard_share,
            config.step.batch,
        )

    def initial(self) -> Weights:
        """Return the network before the first step."""
        stage = self._stage
        return level.initial_level(
            stage.network,
            stage.omega,
            first=self._first,
            seed=stage.seed,
            device=self._frozen.device,
            moving=self._shape.moving,
            config=self._config.step,
        )

    def task(self, start: Callable[[], Weights], step: Step) -> Task:
        """Return the task for `fit`. start: makes the initial network. step: calls `self.step`."""
        band = None if self._first else self._frozen.delta
        rate, output_factor = level.rates(self._stage.network[0], band, self._config.step)
        return Task(
            start=start,
            step=step,
            idle=level.idle_loss(self._surface, self._volume, self.step.weight),
            rate=rate,
            output_factor=output_factor,
            draws=LevelState(self.step, self._sampler, self._miner),
        )

    def callbacks(self, components: ComponentsOfLevel | None, component_seconds: float) -> list[Callback]:
        """Return the callbacks that change what later steps train on: hard-example mining and loss weights.

        A loss weight that the user has chosen stays. components, component_seconds: as in `MineHardExamples`.
        """
        config, step, user = self._config, self.step, self._settings.weights
        schedule = config.mining.schedule
        callbacks: list[Callback] = []
        if not self._first or step.weight.excess > 1:
            mining, count = config.mining, self._stage.samples
            search = components, component_seconds
            callbacks.append(
                MineHardExamples(step, self._miner, self._sampler, count, self._hard_share, mining, *search)
            )
        if self._first:
            return callbacks
        if self._shape.cloud and not self._shape.moving and "length" not in user:
            noise = self._shape.noise
            callbacks.append(FollowSurfaceEikonal(step, self._surface, noise, schedule, config.surface_eikonal))
        if self._exact and "value" not in user:
            callbacks.append(RaiseLateValue(step, schedule, config.loss))
        return callbacks

    def points(self) -> Tensor:
        """Return the points of all samples."""
        return torch.cat((self._surface.points, self._volume.points))

    def _loss_weights(self) -> LossWeights:
        shape = self._shape
        weights = self._config.loss.of_level(
            first=self._first, noise=shape.noise, cloud=shape.cloud, moving=shape.moving
        )
        return replace(weights, **self._settings.weights)
