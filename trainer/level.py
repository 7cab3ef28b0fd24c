"""The training step of one level: f_i = f_{i-1} + r on the samples of its pools, and the loss of Eq. 4."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import pad

from .batches import Batches
from .networks import losses
from .networks.network import Weights, add_derivative, adjoint_pass, initial
from .networks.snapshot import Snapshot, random_state, set_random_state
from .pools import Pool, Sampler
from .settings import LossWeights

BATCH = 4096
"""Samples of a step."""
RATE = 20e-3
"""Peak rate of hidden layers of up to `RATE_WIDTH`; a wider layer's, whose sums are longer, is lower in proportion."""
RATE_WIDTH = 64
OUTPUT_FACTOR = 0.1
"""Factor on the output layer's rate: its weights are smaller by omega_0."""
OUTPUT_FACTOR_PER_DELTA = 5.0
"""The same factor for a residual in a narrow band, per half width: what it has to add is smaller, too."""
HARD_SHARE = 0.1
"""Hard points of a residual's step, as a share of its samples off the surface."""
EXACT_HARD_SHARE = 1 / 6
"""The same where distances are exact next to the surface; those of thin places come on top."""
FIRST_HARD_SHARE = 0.3
"""The same for level 1."""
MOST_HARD_SHARE = 10.0
"""No training's hard points are a larger share."""
RESIDUAL = 0.01
"""Factor on a residual's output layer at its start: it begins near zero."""


def start(
    network: tuple[int, int], omega: float, *, first: bool, seed: int, device: torch.device, moving: bool = False
) -> Callable[[], Weights]:
    """Return a function that makes the level's network as it is before the first step.

    network: (width, depth). omega: omega_0. first: whether it is level 1, not a residual. moving: whether it
    takes time.
    """

    def make() -> Weights:
        generator = torch.Generator().manual_seed(seed)
        weights = initial(network, omega, 1, generator, 1.0 if first else RESIDUAL, moving=moving)
        return [w.to(device) for w in weights]

    return make


def rates(width: int, delta: float | None) -> tuple[float, float]:
    """Choose `Task.rate` and `Task.output_factor` of a level.

    delta: half width of the band that the level is trained in; None for level 1.
    """
    factor = OUTPUT_FACTOR if delta is None else min(OUTPUT_FACTOR, OUTPUT_FACTOR_PER_DELTA * delta)
    return RATE * min(1, RATE_WIDTH / width), factor


def hard_share(*, first: bool, exact: bool) -> float:
    """Choose how many hard points a step sees, as a share of its samples off the surface.

    first: whether it is level 1, not a residual. exact: whether distances are exact next to the surface.
    """
    if first:
        return FIRST_HARD_SHARE
    return EXACT_HARD_SHARE if exact else HARD_SHARE


class LevelStep:
    """The level's training step: one batch of its loss, half of it on the surface, and some hard points."""

    def __init__(
        self,
        surface: Pool,
        volume: Pool,
        weight: LossWeights,
        generator: torch.Generator,
        hard_share: float = HARD_SHARE,
    ) -> None:
        """hard_share: hard points of a step, as a share of its samples off the surface."""
        self._half = min(BATCH // 2, len(surface.points), len(volume.points))
        self._surface, self._volume = (Batches(pool, self._half, generator) for pool in (surface, volume))
        self._generator, self.hard_share = generator, hard_share
        self.weight = weight
        """The weights of the loss as they are by now."""
        self._first_value = weight.value
        self.terms: dict[str, Tensor] = {}
        """The terms of the last batch's loss by name, without their weights."""
        self.hard: Pool | None = None
        """Points off the surface that every step sees a few of (Sampler.hard)."""

    def __call__(self, weights: Weights) -> float:
        """Add the gradients of one batch to the weights' .grad; return the loss, to which hard points add nothing.

        Values on the surface weigh in it what they did at first, so that it can be compared with `idle_loss`.
        """
        on, around = next(self._surface), next(self._volume)
        pools = [on, around, *([] if self.hard is None else [self._some_of(self.hard)])]
        residual = adjoint_pass(weights, torch.cat([pool.points for pool in pools]))
        f = residual.f + torch.cat([pool.frozen for pool in pools])
        gradient = residual.gradient + torch.cat([pool.frozen_gradient for pool in pools])
        usual = len(on.points) + len(around.points)
        loss, d_f, d_gradient, self.terms = level_loss(f[:usual], gradient[:usual], on, around, self.weight)
        if self.hard is not None:
            d_f = torch.cat((d_f, self._hard_derivative(f[usual:], pools[-1], len(around.points))))
            d_gradient = torch.cat((d_gradient, torch.zeros_like(gradient[usual:])))
        add_derivative(weights, residual, d_f, d_gradient)
        return loss.item() - (self.weight.value - self._first_value) * self.terms["value"].item()

    def snapshot(self) -> Snapshot:
        """Return where in the pools the step is, its hard points, and the state of its random numbers."""
        state = self._surface.snapshot().inside("surface") | self._volume.snapshot().inside("volume")
        if self.hard is not None:
            assert self.hard.distance is not None
            state |= Snapshot(tensors={"hard": torch.cat((self.hard.points, self.hard.distance[:, None]), dim=1)})
        numbers = {"length": self.weight.length, "value": self.weight.value, "hard_share": self.hard_share}
        return state | random_state(self._generator) | Snapshot(numbers)

    def restore(self, snapshot: Snapshot, sampler: Sampler) -> None:
        """Go on from a snapshot of a step with the same pools, which `sampler` drew. Raises UserError."""
        self._surface.restore(snapshot.of("surface"))
        self._volume.restore(snapshot.of("volume"))
        for name in ("length", "value"):
            if name in snapshot.numbers:
                self.weight = replace(self.weight, **{name: snapshot.real(name)})
        if "hard_share" in snapshot.numbers:
            self.hard_share = min(abs(snapshot.real("hard_share")), MOST_HARD_SHARE)
        if "hard" in snapshot.tensors:
            hard = snapshot.tensors["hard"]
            hard = snapshot.tensor("hard", hard.new_empty((len(hard), 4), dtype=torch.float32) if hard.ndim else hard)
            known = hard.numpy().astype(np.float64)
            self.hard = sampler.known(known[:, :3], known[:, 3])
        set_random_state(self._generator, snapshot)

    def _some_of(self, hard: Pool) -> Pool:
        count = max(1, round(self._half * self.hard_share))
        index = torch.randint(len(hard.points), (count,), generator=self._generator)
        return hard.take(index.to(hard.points.device))

    def _hard_derivative(self, f: Tensor, hard: Pool, volume: int) -> Tensor:
        """The derivative of the distance term at hard points, each of which counts as one of `volume` samples."""
        assert hard.distance is not None
        weight = self.weight
        _, d_f = losses.distance(f, hard.distance, weight.excess, weight.lacking, weight.near)
        return d_f * (weight.distance * len(f) / volume)


class LevelDraws:
    """What changes from step to step of a level beside its weights (a `Resumable`)."""

    def __init__(self, step: LevelStep, sampler: Sampler) -> None:
        self._step, self._sampler = step, sampler

    def snapshot(self) -> Snapshot:
        """Return the state of the step's batches and of the sampler that looks for hard points."""
        return self._step.snapshot() | self._sampler.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot. Raises UserError."""
        self._sampler.restore(snapshot)
        self._step.restore(snapshot, self._sampler)


def idle_loss(surface: Pool, volume: Pool, weight: LossWeights) -> float:
    """Compute the loss of f_{i-1} alone, which is what a residual that has collapsed to zero is left with."""
    f = torch.cat((surface.frozen, volume.frozen))
    gradient = torch.cat((surface.frozen_gradient, volume.frozen_gradient))
    return level_loss(f, gradient, surface, volume, weight)[0].item()


def level_loss(
    f: Tensor, gradient: Tensor, surface: Pool, volume: Pool, weight: LossWeights
) -> tuple[Tensor, Tensor, Tensor, dict[str, Tensor]]:
    """Compute the loss of Eq. 4, with exact distances where they are known.

    f: (N,), gradient: (N, 3), or (N, 4) with the derivative to time, which the loss leaves alone: of f_i, at the points
    of `surface`, then of `volume`. Returns the loss, its derivatives with respect to f (N,) and to the gradient,
    and its terms by name.
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
