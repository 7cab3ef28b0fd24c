"""A last look at a trained field: loose pieces of its surface are searched for, and trained away."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray

from ..model.model import Model
from .level import HARD_SHARE, LevelStep
from .networks.fit import Budget, Outcome, Task, TrainingProgress, fit
from .networks.network import Weights, clone
from .pools import Pool, Sampler
from .shapes.shape import Doubles, Shape

ROUNDS, STEPS = 5, 300
"""Most rounds of a look, and the optimiser steps of each."""
SLOWER = 0.1
"""Factor on the level's rate."""
POINTS = 20_000
"""Points around the pieces, which a tenth of each step's samples off the surface are drawn from."""
SPREAD = 0.004
"""How far they are from a piece along each axis, model units: standard deviation. A cell of 512^3 is as wide."""
TRUE_ROUNDS = 1
"""Rounds in which the distances around pieces are the shape's.

Later ones have those of a place without the piece where it is thin: a slit that is too narrow for the network to open
is left as hollows, a wall that is too thin as islands, and the shape's distances would keep them.
"""
WITHOUT, WITHOUT_SPREAD = 0.003, 0.002
"""The least of these distances, and `SPREAD` of their points."""
THIN = 0.004
"""A piece that the shape's distances make thicker than twice this may be the shape's own, and stays."""
LEAST_STEPS = 1000
"""A level of fewer steps is not looked at: its flecks are the least that is wrong with it."""
SEARCH, ROUND = 6.0, 11.0
"""Most seconds of a search and of a round, with its own search, in those of measuring the level."""
ROUNDS_IN_TIME, SHARE = 3, 0.3
"""Most rounds that time is kept for where a level has seconds, and the most of these that a look may take."""
FEWEST_STEPS = 100
"""Fewest steps of a round that there is no time for all `STEPS` of."""

Pieces = tuple[int, NDArray[np.float32], NDArray[np.int64]]
"""The number of a surface's loose pieces, which are small and not joined to the largest; their vertices (N, 3), model
space; and the piece that each is of (N,), from 1 on, with a minus where it is a hollow in the solid."""
FindsPieces = Callable[[Model], Pieces]


def seconds_kept(measuring: float, left: float) -> float:
    """Choose how many of a level's `left` seconds are kept for a look; none where not even a short round fits.

    measuring: seconds that measuring the level takes.
    """
    kept = min((SEARCH + ROUNDS_IN_TIME * ROUND) * measuring, SHARE * left)
    shortest = SEARCH + (ROUND - SEARCH) * FEWEST_STEPS / STEPS
    return kept if kept > (SEARCH + shortest) * measuring else 0.0


@dataclass(frozen=True)
class Allowance:
    """The time that a look may take; without end where a level has steps, not seconds."""

    end: float = math.inf
    """Value of time.perf_counter() at which the look is to be over."""
    step: float = 1.0
    """Seconds of an optimiser step."""

    def steps(self, most: float, search: float) -> int:
        """Choose how many steps to take: `most`, or as many as fit before a search of so many seconds.

        0 where fewer than `FEWEST_STEPS` fit.
        """
        fitting = (self.end - time.perf_counter() - search) / self.step
        return int(min(most, fitting)) if fitting >= FEWEST_STEPS else 0


ENDLESS = Allowance()


class LastLook:
    """The last look at one level: what it keeps of the level's seconds, and whether it is made at all."""

    interrupted = False
    """Whether Ctrl-C ended it."""

    def __init__(self, find: Callable[[Weights], Pieces] | None, shape: Shape, progress: TrainingProgress) -> None:
        """find: finds the pieces that there are with such weights; None: the level is not looked at."""
        self._find, self._shape, self._progress = find, shape, progress
        self._began, self._share, self._end = 0.0, 1.0, math.inf

    def leave(self, budget: Budget, measuring: Callable[[], float]) -> Budget:
        """Keep of a level's seconds those of measuring it and of looking at it, and return what is left.

        measuring: tells how many seconds measuring the level takes; asked where seconds are given.
        """
        if budget.steps is not None:
            return budget
        seconds = measuring()
        end = budget.deadline - seconds
        kept = seconds_kept(seconds, end - time.perf_counter()) if self._find is not None else 0.0
        self._began, self._share, self._end = time.perf_counter(), 1 - budget.done, end if kept else 0.0
        return replace(budget, deadline=end - kept)

    def __call__(self, stage: str, outcome: Outcome, task: Task, step: LevelStep, sampler: Sampler) -> Weights:
        """Return what a look makes of the level's weights, as `last_look` does: as they are, where there is none."""
        unfit = outcome.interrupted or outcome.failed or outcome.steps < LEAST_STEPS
        now = time.perf_counter()
        if self._find is None or unfit or now > self._end:
            return outcome.weights
        find, progress = self._find, self._progress
        # Where a training goes on that was cut short, `outcome` has the steps of before, too.
        allowance = Allowance(self._end, (now - self._began) / max(1.0, self._share * outcome.steps))
        try:
            return last_look(stage, outcome.weights, task, step, sampler, self._shape, find, progress, allowance)
        except KeyboardInterrupt:
            progress.end()
            self.interrupted = True
            return outcome.weights


def last_look(
    stage: str,
    start: Weights,
    task: Task,
    step: LevelStep,
    sampler: Sampler,
    shape: Shape,
    find: Callable[[Weights], Pieces],
    progress: TrainingProgress,
    allowance: Allowance = ENDLESS,
) -> Weights:
    """Train a level on for a few steps around its loose pieces. Returns its weights with the fewest of them.

    Where a round fills a slit or breaks a wall that was right before, which other figures hardly show, the next ones
    mend it, too, even if no piece is left: of the weights with the fewest pieces, those with the fewest such places
    are returned.

    stage: what the progress calls it. start, task, step, sampler: of the level's training. find: finds the pieces that
    there are with such weights. allowance: no round begins that does not fit it. Raises KeyboardInterrupt.
    """
    progress.begin(stage)
    began = time.perf_counter()
    first, vertices, piece = find(start)
    search = time.perf_counter() - began
    if not first:
        left = 0 if allowance.end == math.inf else allowance.steps(math.inf, search)
        return _seconds_used(start, task, sampler, find, progress, left)
    weights, rng, closed = start, np.random.default_rng(0), None
    allowed = len(sampler.lost(start).points)
    now = fewest = first, 0  # Pieces, and thin places that are closed.
    kept, after, taken = start, 0, 0
    points, distance, by_shape = np.empty((0, 3)), np.empty(0), True
    held, held_share = step.hard, 0.0 if step.hard is None else step.hard_share
    step.hard_share = held_share + HARD_SHARE
    for number in range(1, ROUNDS + 1):
        steps = allowance.steps(STEPS, search)
        if not any(now) or not steps:
            break
        if now[0]:
            if by_shape and number > TRUE_ROUNDS:  # The shape's own distances would say the opposite.
                points, distance, by_shape = points[:0], distance[:0], False
            near, truth = _around(vertices, piece, shape, by_shape, rng)
            points, distance = np.concatenate((points, near)), np.concatenate((distance, truth))
        if not len(points):
            break
        step.hard = sampler.known(points, distance)
        if closed is not None:
            step.hard = step.hard.and_then(_some_of(closed, len(points) // 2, rng))
        if held is not None:  # What was hard before would be forgotten.
            few = round(len(held.points) * HARD_SHARE / held_share)
            step.hard = held.and_then(_some_of(step.hard, few, rng))
        onward, taken = _trained_on(weights, task, steps, progress), taken + steps
        if onward is None:
            break
        weights = onward
        count, vertices, piece = find(weights)
        lost = sampler.lost(weights)
        if len(lost.points) > allowed:  # The rounds filled a slit, or broke a wall.
            closed = lost
        now = count, max(0, len(lost.points) - allowed)
        if now < fewest:
            fewest, kept, after = now, weights, taken
    progress.end()
    progress.say(_summary(first, fewest[0], after, taken))
    return kept


def _seconds_used(
    start: Weights,
    task: Task,
    sampler: Sampler,
    find: Callable[[Weights], Pieces],
    progress: TrainingProgress,
    steps: int,
) -> Weights:
    """Train a level without loose pieces on for so many steps, which its seconds have left.

    Returns its weights after these, or as they were where there are pieces then, or more thin places that are wrong.
    """
    after = _trained_on(start, task, steps, progress) if steps else None
    if after is not None and (find(after)[0] or len(sampler.lost(after).points) > len(sampler.lost(start).points)):
        after = None
    progress.end()
    progress.say("loose pieces of surface: 0" + (f"; {steps} more steps in the time left" if after is not None else ""))
    return start if after is None else after


def _trained_on(weights: Weights, task: Task, steps: int, progress: TrainingProgress) -> Weights | None:
    """Train a level on at a lower rate. Returns its weights, or None where that fails. Raises KeyboardInterrupt."""
    onward = replace(task, start=partial(clone, weights), rate=SLOWER * task.rate, idle=math.inf, review=None)
    outcome = fit(onward, Budget(steps=steps), progress)
    if outcome.interrupted:
        raise KeyboardInterrupt
    return None if outcome.failed else outcome.weights


def _summary(first: int, fewest: int, after: int, taken: int) -> str:
    """Say what a look made of `first` pieces: `fewest` after `after` of the steps that were `taken`."""
    if after:
        mended = f"; {fewest} after {after} more steps around them"
    else:
        mended = f", which {taken} more steps do not mend" if taken else "; no time is left to train on around them"
    return f"loose pieces of surface: {first}{mended}"


def _some_of(pool: Pool, count: int, rng: np.random.Generator) -> Pool:
    """Draw `count` of a pool's samples, with repetition."""
    return pool.take(torch.from_numpy(rng.integers(len(pool.points), size=count)))


def _around(
    vertices: NDArray[np.float32], piece: NDArray[np.int64], shape: Shape, by_shape: bool, rng: np.random.Generator
) -> tuple[Doubles, Doubles]:
    """Draw points around pieces. Returns those whose distance is known (N, 3), and what f is to be there (N,).

    by_shape: whether that is the shape's distance everywhere; else, around thin pieces, that of a place without them.
    """
    chosen = rng.integers(len(vertices), size=POINTS)
    without = np.zeros(POINTS, np.bool_) if by_shape else _thin(vertices, piece, shape)[chosen]
    spread = np.where(without, WITHOUT_SPREAD, SPREAD)[:, None]
    near = vertices[chosen] + spread * rng.normal(size=(POINTS, 3))
    truth = shape.distance(near)
    truth = np.where(without, np.sign(piece[chosen]) * np.maximum(np.abs(truth), WITHOUT), truth)
    known = ~np.isnan(truth)
    return near[known], truth[known]


def _thin(vertices: NDArray[np.float32], piece: NDArray[np.int64], shape: Shape) -> NDArray[np.bool_]:
    """Tell which vertices (N, 3) are of pieces that are thin by the shape's distances, or not there at all. (N,).

    piece: as `Pieces` has it. Distances are looked at between a piece's vertices and their mean.
    """
    number = np.abs(piece) - 1
    sums = np.stack([np.bincount(number, column) for column in vertices.T], axis=1)
    centres = (sums / np.maximum(np.bincount(number), 1)[:, None])[number]
    deepest = np.zeros(number.max() + 1)
    for share in (0.25, 0.5, 0.75, 1.0):
        depth = -np.sign(piece) * shape.distance(vertices + share * (centres - vertices))
        np.fmax.at(deepest, number, depth)
    return np.asarray(deepest[number] < THIN)
