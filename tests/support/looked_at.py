"""A level of a ball that a last look is made at, and what the look finds."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch

from mplicits.trainer import last_look
from mplicits.trainer.last_look import Pieces
from mplicits.trainer.level import LevelStep
from mplicits.trainer.networks.fit import Task
from mplicits.trainer.networks.network import Weights, initial
from mplicits.trainer.pools import Sampler
from mplicits.trainer.settings import RESIDUAL
from mplicits.trainer.shapes.shape import Shape

DELTA = 0.05
SPOT = np.array([[1.02, 0.0, 0.0]])
"""A point outside of the ball."""


@dataclass
class Level:
    """A level that `last_look` is to look at."""

    start: Weights
    shape: Shape
    sampler: Sampler
    step: LevelStep
    task: Task
    look: Callable[..., Weights]


def level_of(ball: Shape) -> Level:
    """Return level 2 of a ball, f_1 = 0."""
    nothing = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.zeros(1)]
    sampler = Sampler(ball, [nothing], [DELTA], torch.device("cpu"), np.random.default_rng(0))
    start = initial((8, 1), 5.0, 1, torch.Generator().manual_seed(0), 0.01)
    step = LevelStep(sampler.surface(512), sampler.volume(512), RESIDUAL, torch.Generator().manual_seed(0))
    task = Task(lambda: start, step, idle=1.0, rate=0.02, output_factor=0.1)
    look = partial(last_look.last_look, "level 2, loose pieces (8x1)", start, task, step, sampler, ball)
    return Level(start, ball, sampler, step, task, look)


def finding(*counts: int) -> Callable[[Weights], Pieces]:
    """Find so many pieces, in turn, all at `SPOT`."""
    left = list(counts)

    def find(weights: Weights) -> Pieces:
        count = left.pop(0)
        return count, np.repeat(SPOT, count, axis=0).astype(np.float32), np.arange(1, count + 1)

    return find
