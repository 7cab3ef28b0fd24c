"""A last look at a trained field: loose pieces of its surface are searched for, and trained away."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..model.model import Model
from .level import LevelStep
from .networks.fit import Budget, Task, TrainingProgress, fit
from .networks.network import Weights, clone
from .pools import Sampler
from .shapes.shape import Shape

ROUNDS, STEPS = 3, 300
"""Most rounds of a look, and the optimiser steps of each."""
SLOWER = 0.05
"""Factor on the level's rate."""
POINTS = 20_000
"""Points around the pieces, which a tenth of each step's samples off the surface are drawn from."""
SPREAD = 0.004
"""How far they are from a piece along each axis, model units: standard deviation. A cell of 512^3 is as wide."""
LEAST_STEPS = 1000
"""A level of fewer steps is not looked at: its flecks are the least that is wrong with it."""
COST, ROUND_SHARE, SHARE = 25.0, 0.6, 0.15
"""Seconds of a search and a round, in those of measuring the level; the round's share of them, with its own search; and
the most of a level's seconds that they may be."""

Pieces = tuple[int, NDArray[np.float32]]
"""The number of a surface's loose pieces, which are small and not joined to the largest; and (N, 3), model space, their
vertices."""
FindsPieces = Callable[[Model], Pieces]


def seconds_kept(measuring: float, left: float) -> float:
    """Choose how many of the `left` seconds of a level are kept for looking at it: a search and a round, or none.

    measuring: seconds that measuring the level takes.
    """
    asked = COST * measuring
    return asked if asked < SHARE * left else 0.0


def last_begin(end: float, kept: float) -> float:
    """Return when a round may begin at the latest of a look that has `kept` seconds and ends at `end`."""
    return end - ROUND_SHARE * kept


def last_look(
    stage: str,
    start: Weights,
    task: Task,
    step: LevelStep,
    sampler: Sampler,
    shape: Shape,
    find: Callable[[Weights], Pieces],
    progress: TrainingProgress,
    until: float = math.inf,
) -> Weights:
    """Train a level on for a few steps around its loose pieces. Returns its weights with the fewest of them.

    stage: what the progress calls it. start, task, step, sampler: of the level's training. find: finds the pieces that
    there are with such weights. until: value of time.perf_counter() from which on no round begins. Raises
    KeyboardInterrupt.
    """
    progress.begin(stage)
    first, vertices = find(start)
    weights, count, rng = start, first, np.random.default_rng(0)
    fewest, kept, after = first, start, 0
    points, distance = np.empty((0, 3)), np.empty(0)
    for number in range(1, ROUNDS + 1):
        if not count or time.perf_counter() > until:
            break
        near = vertices[rng.integers(len(vertices), size=POINTS)] + rng.normal(scale=SPREAD, size=(POINTS, 3))
        truth = shape.distance(near)
        known = ~np.isnan(truth)
        points, distance = np.concatenate((points, near[known])), np.concatenate((distance, truth[known]))
        if not len(points):
            break
        step.hard = sampler.known(points, distance)
        onward = replace(task, start=partial(clone, weights), rate=SLOWER * task.rate, idle=math.inf, review=None)
        outcome = fit(onward, Budget(steps=STEPS), progress)
        if outcome.interrupted:
            raise KeyboardInterrupt
        if outcome.failed:
            break
        weights = outcome.weights
        count, vertices = find(weights)
        if count < fewest:
            fewest, kept, after = count, weights, number * STEPS
    progress.end()
    if not first:
        return start
    mended = f"; {fewest} after {after} more steps around them" if after else ", which more steps do not mend"
    progress.say(f"loose pieces of surface: {first}{mended}")
    return kept
