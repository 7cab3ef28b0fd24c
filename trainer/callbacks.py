"""Callbacks of a level's training: hard-example mining, adaptive loss weights, checkpoints and previews."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch

from ..model.errors import UserError
from ..model.model import Model
from .checkpoint import CheckpointFile
from .config import LossConfig, SurfaceEikonalConfig
from .level import LevelStep
from .mining import Miner
from .mining_config import MiningConfig
from .networks.callback import Callback, FitState
from .networks.network import Weights, adjoint_pass
from .shapes.shape import Doubles
from .training_samples import Pool, Sampler

ComponentsOfLevel = Callable[[Weights], Doubles]
"""Weights of the level under training -> vertices (N, 3) of the loose components of its surface, model space."""


class MineHardExamples(Callback):
    """Mines hard examples at fixed shares of the schedule; every later step trains on some of them."""

    def __init__(
        self,
        step: LevelStep,
        miner: Miner,
        sampler: Sampler,
        candidates: int,
        share: float,
        config: MiningConfig,
        components: ComponentsOfLevel | None = None,
        component_seconds: float = 0.0,
    ) -> None:
        """candidates: most candidates of each kind. share: of `LevelStep.hard_share`, without thin features.

        components: finds the loose components of the surface; None: they are not mined. component_seconds: estimated
        time of that.
        """
        self._components, self._component_seconds = components, component_seconds
        self._step, self._miner, self._sampler = step, miner, sampler
        self._candidates, self._share, self._config = candidates, share, config
        self._near = step.weight.near
        self._seconds = 0.0  # Seconds that the last mining took.

    def before_step(self, state: FitState) -> None:
        """Mine, unless that would take too much of the remaining time."""
        config, step = self._config, self._step
        if not state.reaches(config.schedule) or self._seconds >= config.longest * state.seconds_left:
            return
        began = time.perf_counter()
        earlier = None if step.hard is None else np.asarray(step.hard.points.cpu(), np.float64)
        found = self._miner.mine(state.weights, earlier, self._candidates, self._near)
        late = state.reaches(config.components) and state.steps >= config.components_steps
        if self._components and late and self._component_seconds < config.longest * state.seconds_left:
            vertices = self._components(state.weights)
            if len(vertices):
                found = self._miner.around(found, vertices)
        step.hard = None
        if found is not None:
            step.hard = self._sampler.pool(found.points, distance=found.distance)
            step.hard_share = self._share * found.ratio
        self._seconds = time.perf_counter() - began


class RaiseLateValue(Callback):
    """Raises the weight of values on the surface late in the schedule, when the field is no longer flattened by it."""

    def __init__(self, step: LevelStep, schedule: tuple[float, ...], config: LossConfig) -> None:
        """schedule: shares of the schedule at which the weight is set."""
        self._step, self._schedule, self._config, self._value = step, schedule, config, step.weight.value

    def before_step(self, state: FitState) -> None:
        """Set the weight."""
        if state.reaches(self._schedule):
            factor = self._config.late_value if state.share >= self._config.late else 1.0
            self._step.weight = replace(self._step.weight, value=factor * self._value)


class FollowSurfaceEikonal(Callback):
    """Adapts the Eikonal weight on a cloud's surface, so that |grad f| is near 1 on most of it."""

    def __init__(
        self, step: LevelStep, surface: Pool, noise: float, schedule: tuple[float, ...], config: SurfaceEikonalConfig
    ) -> None:
        """noise: standard deviation of the noise that was removed from the cloud, model units.

        schedule: shares of the schedule at which the weight changes.
        """
        self._step, self._schedule, self._config, self._least = step, schedule, config, step.weight.length
        self._surface = surface.take(slice(config.points))
        self._goal = surface_goal(noise, config)

    def before_step(self, state: FitState) -> None:
        """Measure the gradient, and change the weight."""
        if state.reaches(self._schedule):
            share = share_near_one(state.weights, self._surface, self._config)
            length = followed_length(self._step.weight.length, share, self._goal, self._least, self._config)
            self._step.weight = replace(self._step.weight, length=length)


def surface_goal(noise: float, config: SurfaceEikonalConfig) -> float:
    """Return the share of a cloud's surface on which |grad f| is to be near 1. noise: as `FollowSurfaceEikonal`."""
    return min(config.goal + config.goal_per_noise * noise, config.largest_goal)


def share_near_one(weights: Weights, surface: Pool, config: SurfaceEikonalConfig) -> float:
    """Measure the share of surface samples at which |grad f_i| in space is near 1."""
    gradient = adjoint_pass(weights, surface.points).gradient + surface.frozen_gradient
    length = torch.linalg.vector_norm(gradient[:, :3], dim=1)
    return float(((length > config.shortest) & (length < config.longest)).float().mean())


def followed_length(length: float, share: float, goal: float, least: float, config: SurfaceEikonalConfig) -> float:
    """Return the next `LossWeights.length`, at least `least`. share: measured share; goal: wanted share, below 1."""
    if share < config.least_learnt:
        return length
    factor = float(np.clip(((1 - share) / (1 - goal)) ** 0.5, config.least_factor, config.largest_factor))
    return min(max(length * factor, least), config.largest)


class Checkpoint(Callback):
    """Writes the training's state to a file now and then, and when Ctrl-C ends it."""

    def __init__(self, part: CheckpointFile, write: Callable[[FitState], None]) -> None:
        self._part, self._write = part, write

    def after_step(self, state: FitState) -> None:
        """Write the file if it is due."""
        if self._part.due() and state.finite():
            self._write(state)

    def after_interrupt(self, state: FitState) -> None:
        """Write the file."""
        self._write(state)


class ShowLevels(Callback):
    """Passes the model on after every level. What fails there, such as a file on a full disk, costs no training."""

    def __init__(self, show: Callable[[Model], object], say: Callable[[str], None]) -> None:
        """say: receives a warning in place of a UserError."""
        self._show, self._say = show, say

    def after_level(self, model: Callable[[], Model]) -> None:
        """Pass the model on."""
        try:
            self._show(model())
        except UserError as error:
            self._say(f"warning: {error}")
