"""How much time or how many steps, and how many samples, each stage of a training gets."""

import time

import numpy as np

from .networks.fit import Budget
from .settings import Settings

POOL = 200_000
"""Most samples of a pool."""
POOL_LEAST = 8192
"""Fewest samples of a pool."""
POOL_PER_STEP = 100
"""Samples of a pool for each step, between these limits."""
POOL_PER_SECOND = 6000
"""The same for each second, where seconds are given."""
WRITING = 0.1
"""Seconds kept for writing the file."""
RESIDUAL_COST = 3
"""Seconds of a residual for each of level 1 at the same cost of a step."""
TEXTURE_COST = 0.5
"""Seconds of the texture for each of the costliest level."""


def budgets(settings: Settings, finished: int, done: float, texture: bool, began: float, kept: float) -> list[Budget]:
    """Plan a training: a budget for every level, then one for the texture.

    finished: levels that are trained already. done: share of the next one that is. texture: whether the texture is to
    be trained. began: the value of time.perf_counter() from which on the user's seconds count. kept: seconds for what
    comes after the last stage. Seconds are shared out by the square root of the cost of a step. Level 1 gets a share
    by the largest network's cost: what it gets wrong, far from the surface, costs every residual.
    """
    if settings.seconds is None:
        return [Budget(steps=steps) for steps in settings.steps]
    roots = [_step_cost(network) ** 0.5 for network in settings.networks]
    costs = []
    for i, root in enumerate(roots):
        if i < finished:
            costs.append(0.0)
        else:
            costs.append(RESIDUAL_COST * root if i else max(roots))
    costs.append(TEXTURE_COST * max(costs) if texture else 0.0)
    if finished < len(roots):
        costs[finished] *= 1 - done
    ends = np.cumsum(costs) / max(sum(costs), 1e-9)
    now = time.perf_counter()
    left = began + settings.seconds - kept - WRITING - now
    return [Budget(deadline=now + left * float(end)) for end in ends]


def pool_size(budget: Budget) -> int:
    """Choose the number of samples of a pool: enough that a stage of this budget does not learn them by heart."""
    if budget.steps is not None:
        samples = budget.steps * POOL_PER_STEP
    else:
        samples = int((budget.deadline - time.perf_counter()) * POOL_PER_SECOND)
    return min(max(samples, POOL_LEAST), POOL)


def _step_cost(network: tuple[int, int]) -> float:
    """Estimate the cost of a step of a (width, depth) network: the number of its weights, nearly."""
    width, depth = network
    return width * 4 + width * width * depth
