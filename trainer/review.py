"""What is looked at while a level is trained, and what its later steps make of it."""

import math
import time
from dataclasses import dataclass, replace

import numpy as np
import torch

from .level import LevelStep
from .networks.network import Weights, adjoint_pass
from .pools import Pool, Sampler
from .settings import LATE, LATE_VALUE, LossWeights

LOW, HIGH = 0.8, 1.2
"""|grad f| is to lie between these on 90 % of the surface."""
SHARE, SHARE_PER_NOISE, MOST_SHARE = 0.92, 3.5, 0.985
"""Share of the points that it is to do so on, more for each unit of noise that was removed from them, and the most: on
such points, which are not quite on the surface, it is nearer to 1 than on the surface itself."""
LEARNT = 0.6
"""Where the share is below this, the level has yet to learn the surface, and the weight stays as it is."""
POINTS = 20_000
"""Points that it is measured at."""
LEAST_FACTOR, MOST_FACTOR, MOST = 0.5, 3.0, 200.0
"""By how much the weight of the length changes in a review at most, and how large it becomes."""
LONGEST = 1 / 3
"""A search for hard points that would take a larger share of the time that is left is left out."""


@dataclass(eq=False)
class Review:
    """A review of a level (`fit.Task.review`), which later steps follow."""

    step: LevelStep
    """The level's step, which is changed."""
    sampler: Sampler
    surface: Pool
    """What `step` is trained on."""
    weight: LossWeights
    """Of the level, as they are at its start."""
    candidates: int
    """At most so many of each kind are looked at for hard points."""
    aim: float | None
    """What `aim` says for a cloud; None: the weight of the gradient's length stays as it is."""
    late: bool
    """Whether values on the surface weigh more late in the schedule."""
    hard_share: float
    """Of the step's hard points (level.LevelStep), without those of thin places."""
    seconds: float = 0.0
    """That the last search for hard points took."""

    def __call__(self, weights: Weights, share: float, left: float = math.inf) -> None:
        """Find the level's hard points anew, with its weights as they are now, and change those of the loss.

        share: of the schedule that is done. left: seconds of the schedule, of which a search takes no more than
        `LONGEST` if it takes as long as the last one.
        """
        step = self.step
        if self.seconds < LONGEST * left:
            began = time.perf_counter()
            step.hard = self.sampler.hard(weights, step.hard, self.candidates, self.weight.near)
            step.hard_share = self.hard_share * self.sampler.hard_times
            self.seconds = time.perf_counter() - began
        if self.aim is not None:
            found = within(weights, self.surface)
            length = followed(step.weight.length, found, self.aim, self.weight.length)
            step.weight = replace(step.weight, length=length)
        if self.late:
            step.weight = replace(step.weight, value=self.weight.value * (LATE_VALUE if share >= LATE else 1))


def aim(noise: float) -> float:
    """Choose the share of a cloud's points on which |grad f| is to be between `LOW` and `HIGH`.

    noise: standard deviation of the noise that was removed from them, model units.
    """
    return min(SHARE + SHARE_PER_NOISE * noise, MOST_SHARE)


def within(weights: Weights, surface: Pool) -> float:
    """Measure the share of the surface on which |grad f_i| in space is between `LOW` and `HIGH`.

    weights: of the level's network. surface: samples of the surface, with the gradients of the levels before.
    """
    some = surface.take(slice(POINTS))
    gradient = adjoint_pass(weights, some.points).gradient + some.frozen_gradient
    length = torch.linalg.vector_norm(gradient[:, :3], dim=1)
    return float(((length > LOW) & (length < HIGH)).float().mean())


def followed(length: float, share: float, wanted: float, least: float) -> float:
    """Choose `LossWeights.length` for the steps until the next review.

    length: as it was. share: of the surface, as `within` says; wanted: what it is to be, less than 1. least: what the
    weight never falls below.
    """
    if share < LEARNT:
        return length
    factor = float(np.clip(((1 - share) / (1 - wanted)) ** 0.5, LEAST_FACTOR, MOST_FACTOR))
    return min(max(length * factor, least), MOST)
