"""A stage of a training, a level or the texture: how it begins, and what a checkpoint holds of it."""

import time
from dataclasses import dataclass, replace

from ..model.errors import UserError
from . import plan
from .config import TrainingConfig
from .networks.fit import Budget
from .networks.snapshot import Snapshot


@dataclass(frozen=True)
class Stage:
    """The training of one network: a level or the texture."""

    name: str
    """As the progress shows it: "level 1"."""
    network: tuple[int, int]
    """(width, depth)."""
    omega: float
    """omega_0."""
    seed: int
    """Seed of all its random numbers."""
    samples: int
    """Samples of each pool."""
    budget: Budget
    began: float
    """Value of time.perf_counter() at its start, less the seconds of interrupted runs."""
    resume: Snapshot | None
    """State of the interrupted run that this one continues; None: it starts from random weights."""

    @property
    def size(self) -> str:
        """The network's size, as "64x2"."""
        width, depth = self.network
        return f"{width}x{depth}"

    def checkpoint(self) -> Snapshot:
        """Return what `begin` needs to continue this stage."""
        seconds = time.perf_counter() - self.began
        return Snapshot({"network": list(self.network), "pool": self.samples, "seconds": seconds})


def begin(
    name: str,
    network: tuple[int, int],
    omega: float,
    seed: int,
    budget: Budget,
    snapshot: Snapshot,
    config: TrainingConfig,
) -> Stage:
    """Begin a stage, or continue the one in which a training was interrupted. snapshot: of that, or empty.

    Raises UserError where the snapshot is damaged.
    """
    began = time.perf_counter()
    if snapshot.numbers.get("network") != list(network):
        samples = plan.pool_size(plan.prepared(budget, config.budget), config.sampling)
        return Stage(name, network, omega, seed, samples, budget, began, None)
    # The steps of the interrupted run count; of the seconds, the budget has only the remaining ones.
    done = snapshot.real("fraction") if budget.steps is None else 0.0
    began -= snapshot.real("seconds")
    samples = snapshot.whole("pool")
    if samples > config.sampling.largest_pool:
        raise UserError("training: 'pool' is larger than any")
    return Stage(name, network, omega, seed, samples, replace(budget, done=done), began, snapshot)
