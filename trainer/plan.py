"""The plan of a training: time or steps, and the number of samples, of each stage."""

import time
from dataclasses import replace

import numpy as np

from ..model.errors import UserError
from .config import BudgetConfig, SamplingConfig
from .networks.fit import Budget
from .settings import Settings


def budgets(
    settings: Settings,
    finished: int,
    done: float,
    texture: bool,
    began: float,
    measuring: float,
    config: BudgetConfig | None = None,
    spent: float = 0.0,
) -> list[Budget]:
    """Plan a training: return a budget for every level, then one for the texture.

    finished: number of levels already trained. done: share of the next level that is. texture: whether to train a
    texture. began: value of time.perf_counter() from which the user's seconds count. measuring: seconds of measuring
    the model at the end. spent: the user's seconds that earlier runs took. Each stage's seconds are proportional to the
    square root of the cost of its step. Level 1 gets the seconds of the largest network: its errors far from the
    surface cost every residual.
    """
    config = config or BudgetConfig()
    if settings.seconds is None:
        return [Budget(steps=steps) for steps in settings.steps]
    roots = [_step_cost(network) ** 0.5 for network in settings.networks]
    costs = []
    for i, root in enumerate(roots):
        if i < finished:
            costs.append(0.0)
        else:
            costs.append(config.residual * root if i else max(roots))
    costs.append(config.texture * max(costs) if texture else 0.0)
    if finished < len(roots):
        costs[finished] *= 1 - done
    ends = np.cumsum(costs) / max(sum(costs), 1e-9)
    now, seconds = time.perf_counter(), settings.seconds - spent
    left = max(began + seconds - measuring - config.writing - now, config.least * seconds)
    return [
        Budget(deadline=now + left * float(end), seconds=seconds * float(share))
        for end, share in zip(ends, np.diff(ends, prepend=0.0), strict=True)
    ]


def check_time(settings: Settings, spent: float) -> None:
    """Raise UserError where the earlier runs, of `spent` seconds, have used up the user's seconds."""
    seconds = settings.seconds
    if seconds is not None and seconds < spent + 1:
        raise UserError(
            f"--seconds {seconds:g}: the interrupted training already took {spent:.0f} s; give more seconds"
        )


def prepared(budget: Budget, config: BudgetConfig) -> Budget:
    """Return the budget of a stage whose steps begin now: they get a least share of its seconds."""
    if budget.steps is not None:
        return budget
    return replace(budget, deadline=max(budget.deadline, time.perf_counter() + config.least * budget.seconds))


def pool_size(budget: Budget, config: SamplingConfig) -> int:
    """Return the number of samples of a pool: enough that a stage of this budget does not overfit them."""
    if budget.steps is not None:
        samples = budget.steps * config.pool_per_step
    else:
        samples = int((budget.deadline - time.perf_counter()) * config.pool_per_second)
    return min(max(samples, config.smallest_pool), config.largest_pool)


def _step_cost(network: tuple[int, int]) -> float:
    """Estimate the cost of a step of a (width, depth) network by its number of weights."""
    width, depth = network
    return width * 4 + width * width * depth
