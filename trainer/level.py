"""The training step of one level: f_i = f_{i-1} + r on batches of its samples, and the loss of Eq. 4."""

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import pad

from .config import LossWeights, StepConfig
from .mining import Miner
from .mining_config import MiningConfig
from .networks import losses
from .networks.network import Weights, add_derivative, adjoint_pass, initial
from .networks.replay import Replay
from .networks.snapshot import Snapshot, random_state, set_random_state
from .training_samples import COLUMNS, Batches, Pool, Sampler

MOST_HARD_SHARE = 10.0
"""Largest `LevelStep.hard_share` that is read from a checkpoint."""
TERMS = "value", "normal", "distance", "eikonal"
"""Names of the loss's terms, in the order of `level_loss`."""


def initial_level(
    network: tuple[int, int],
    omega: float,
    *,
    first: bool,
    seed: int,
    device: torch.device,
    moving: bool = False,
    config: StepConfig,
) -> Weights:
    """Return the initial network of a level.

    network: (width, depth). omega: omega_0. first: level 1, not a residual. moving: the network takes the time, too.
    """
    generator = torch.Generator().manual_seed(seed)
    weights = initial(network, omega, 1, generator, 1.0 if first else config.residual_output, moving=moving)
    return [w.to(device) for w in weights]


def rates(width: int, delta: float | None, config: StepConfig) -> tuple[float, float]:
    """Return `Task.rate` and `Task.output_factor` of a level.

    delta: half-width of the band in which the level is trained; None for level 1.
    """
    factor = config.output_factor
    if delta is not None:
        factor = min(factor, config.output_factor_per_delta * delta)
    return config.rate * min(1, config.rate_width / width), factor


def hard_share(config: MiningConfig, *, first: bool, exact: bool) -> float:
    """Return the share of hard samples in a step of level 1 or of a residual. exact: as `mining.exact_distances`."""
    if first:
        return config.first_share
    return config.exact_share if exact else config.share


class LevelStep:
    """The training step of a level: a batch of its loss, half of it on the surface, and some hard examples."""

    def __init__(
        self,
        surface: Pool,
        volume: Pool,
        weight: LossWeights,
        generator: torch.Generator,
        hard_share: float = MiningConfig.share,
        batch: int = StepConfig.batch,
    ) -> None:
        """batch: samples of a step."""
        self._half = min(batch // 2, len(surface.points), len(volume.points))
        self._surface, self._volume = (Batches(pool, self._half, generator) for pool in (surface, volume))
        self._generator, self._columns = generator, surface.points.shape[1]
        self._first_value, self._replay = weight.value, Replay()
        self.weight = weight
        """Present weights of the loss; callbacks change them."""
        self.terms: dict[str, float] = {}
        """Terms of the last batch's loss by name, without their weights."""
        self.hard: Pool | None = None
        """Present hard examples (mining.py)."""
        self.hard_share = hard_share
        """Hard examples of a step, as a share of its samples off the surface."""

    def __call__(self, weights: Weights) -> float:
        """Add the gradients of one batch to the weights' .grad, and return the loss without hard examples.

        The returned loss has the initial weight of values on the surface, for comparison with `idle_loss`.
        """
        pools = [next(self._surface), next(self._volume)]
        if self.hard is not None:
            pools.append(self._some_of(self.hard))
        columns = [column for pool in pools for column in pool.columns()]
        loss, *terms = self._replay(add_gradients, weights, self.weight, *columns).tolist()
        self.terms = dict(zip(TERMS, terms, strict=True))
        return float(loss - (self.weight.value - self._first_value) * self.terms["value"])

    def snapshot(self) -> Snapshot:
        """Return the state of batches and random numbers, the hard examples, and the weights that change."""
        state = self._surface.snapshot().inside("surface") | self._volume.snapshot().inside("volume")
        if self.hard is not None:
            assert self.hard.distance is not None
            state |= Snapshot(tensors={"hard": torch.cat((self.hard.points, self.hard.distance[:, None]), dim=1)})
        numbers = {"length": self.weight.length, "value": self.weight.value, "hard_share": self.hard_share}
        return state | random_state(self._generator) | Snapshot(numbers)

    def restore(self, snapshot: Snapshot, sampler: Sampler) -> None:
        """Resume from a snapshot of a step with the same pools, which `sampler` drew.

        Raises UserError where the snapshot is damaged.
        """
        self._surface.restore(snapshot.of("surface"))
        self._volume.restore(snapshot.of("volume"))
        for name in ("length", "value"):
            if name in snapshot.numbers:
                self.weight = replace(self.weight, **{name: snapshot.real(name)})
        if "hard_share" in snapshot.numbers:
            self.hard_share = min(abs(snapshot.real("hard_share")), MOST_HARD_SHARE)
        if "hard" in snapshot.tensors:
            known = snapshot.rows("hard", self._columns + 1).numpy().astype(np.float64)
            self.hard = sampler.pool(known[:, :-1], distance=known[:, -1])
        set_random_state(self._generator, snapshot)

    def _some_of(self, hard: Pool) -> Pool:
        count = max(1, round(self._half * self.hard_share))
        index = torch.randint(len(hard.points), (count,), generator=self._generator)
        return hard.take(index.to(hard.points.device, non_blocking=True))


class LevelState:
    """The state of a level's training beside its weights: batches, hard examples, random numbers (a `Resumable`)."""

    def __init__(self, step: LevelStep, sampler: Sampler, miner: Miner) -> None:
        self._step, self._sampler, self._miner = step, sampler, miner

    def snapshot(self) -> Snapshot:
        """Return the state."""
        return self._step.snapshot() | self._sampler.snapshot() | self._miner.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from a snapshot. Raises UserError where it is damaged."""
        self._miner.restore(snapshot)
        self._sampler.restore(snapshot)
        self._step.restore(snapshot, self._sampler)


def add_gradients(weights: Weights, weight: LossWeights, *columns: Any) -> Tensor:
    """Add the gradients of a batch to the weights' .grad. Returns the loss without hard examples and its terms (5,).

    columns: `Pool.columns` of samples on the surface, of samples off it, and of hard examples, if there are any. The
    terms have the order of `TERMS`.
    """
    pools = [Pool(*columns[i : i + COLUMNS]) for i in range(0, len(columns), COLUMNS)]
    on, around, *hard = pools
    residual = adjoint_pass(weights, torch.cat([pool.points for pool in pools]))
    f = residual.f + torch.cat([pool.frozen for pool in pools])
    gradient = residual.gradient + torch.cat([pool.frozen_gradient for pool in pools])
    own = len(on.points) + len(around.points)
    loss, d_f, d_gradient, terms = level_loss(f[:own], gradient[:own], on, around, weight)
    for pool in hard:
        d_f = torch.cat((d_f, hard_derivative(f[own:], pool, len(around.points), weight)))
        d_gradient = torch.cat((d_gradient, torch.zeros_like(gradient[own:])))
    add_derivative(weights, residual, d_f, d_gradient)
    return torch.stack([loss, *(terms[name] for name in TERMS)])


def hard_derivative(f: Tensor, hard: Pool, volume: int, weight: LossWeights) -> Tensor:
    """Return the derivative of the distance term at hard points, each counted as one of `volume` samples."""
    assert hard.distance is not None
    _, d_f = losses.distance(f, hard.distance, weight.excess, weight.lacking, weight.near)
    return d_f * (weight.distance * len(f) / volume)


def idle_loss(surface: Pool, volume: Pool, weight: LossWeights) -> float:
    """Compute the loss of f_{i-1} alone: that of a residual which has collapsed to zero."""
    f = torch.cat((surface.frozen, volume.frozen))
    gradient = torch.cat((surface.frozen_gradient, volume.frozen_gradient))
    return level_loss(f, gradient, surface, volume, weight)[0].item()


def level_loss(
    f: Tensor, gradient: Tensor, surface: Pool, volume: Pool, weight: LossWeights
) -> tuple[Tensor, Tensor, Tensor, dict[str, Tensor]]:
    """Compute the loss of Eq. 4, with exact distances where they are known.

    f: (N,), values of f_i at the points of `surface`, then of `volume`. gradient: (N, 3), gradients of f_i there; or
    (N, 4) with the time derivative, which the loss ignores. Returns the loss, its derivatives with respect to f (N,)
    and to the gradient, and its terms by name.
    """
    assert surface.distance is not None
    assert surface.normals is not None
    assert volume.distance is not None
    on = len(surface.points)
    value, d_value = losses.value(f[:on], surface.distance)
    distance, d_distance = losses.distance(f[on:], volume.distance, weight.excess, weight.lacking, weight.near)
    in_space = gradient[:, :3]
    normal, d_normal = losses.normal(in_space[:on], surface.normals)
    eikonal, d_eikonal = losses.eikonal(in_space)
    loss = weight.value * value + weight.normal * normal + weight.distance * distance + weight.eikonal * eikonal
    d_gradient = d_eikonal.mul_(weight.eikonal)
    if weight.length != 1.0:
        more = weight.eikonal * (weight.length - 1) * on / len(f)
        loss = loss + more * losses.eikonal(in_space[:on])[0]
        d_gradient[:on].mul_(weight.length)
    d_gradient[:on].add_(d_normal, alpha=weight.normal)
    if gradient.shape[1] > 3:
        d_gradient = pad(d_gradient, (0, 1))
    terms = {"value": value, "normal": normal, "distance": distance, "eikonal": eikonal}
    return loss, torch.cat((weight.value * d_value, weight.distance * d_distance)), d_gradient, terms
