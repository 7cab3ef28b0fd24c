"""The contenders of Table 10: NeuS's own network and optimization, and ours.

NeuS's differentiates its gradient by autograd. Ours has the adjoint pass and its derivative written by hand;
`TwiceDifferentiated` uses autograd instead, to time the difference.
"""

import statistics
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from mplicits.capture.learner import Learner
from mplicits.capture.rays import RayBatches, Rays
from mplicits.capture.rendering import Effort, Factors, Shade, loss_of, render
from mplicits.capture.scene import MultiscaleScene
from mplicits.mesher.surface import Array
from neus import NeusScene

SEED = 0
WIDTH, LAYERS, SKIP = 256, 8, 4
"""NeuS's network; the radiance network has the same width on both sides."""
DELTAS = (0.08,)
"""Half width of level 1's band."""
NEUS_RATE, WARM_UP = 5e-4, 5000 / 300_000
"""Rate, and the share of the schedule in which it rises (NeuS's wmask.conf)."""
NEUS_FACTORS = Factors(eikonal=0.1, mask=0.1)
"""Weights of the terms of its loss (NeuS's wmask.conf)."""
STEPS = 9
"""Timed steps, to compare two ways to differentiate."""


class Contender(Protocol):
    """A way to train a scene."""

    def step(self, share: float) -> float:
        """Take a step at a share of the schedule, and return the loss."""


class NeusLearner:
    """NeuS's optimization at a peak rate."""

    def __init__(self, rays: Rays, count: int, effort: Effort, width: int, rate: float) -> None:
        """rays: to learn from, `count` a step; the networks are on their device."""
        self.scene = NeusScene(width, LAYERS, SKIP, width, SEED, rays.eyes.device)
        self._generator = torch.Generator().manual_seed(SEED)
        self._batches = RayBatches(rays, count, self._generator)
        self._adam, self._rate, self._effort = torch.optim.Adam(self.scene.parameters(), lr=rate), rate, effort

    def step(self, share: float) -> float:
        """Take a step."""
        rays = next(self._batches)
        loss = loss_of(render(self.scene, rays, self._effort, self._generator), rays, NEUS_FACTORS, 0.0)
        self._adam.zero_grad()
        self.scene.backward(loss)
        for group in self._adam.param_groups:
            rising = share / WARM_UP if share < WARM_UP else 0.05 + 0.95 * (0.5 + 0.5 * np.cos(np.pi * share))
            group["lr"] = self._rate * rising
        self._adam.step()
        return float(loss.detach())


class TwiceDifferentiated(MultiscaleScene):
    """Ours, with the gradient by autograd and the loss differentiated through it."""

    def evaluate(self, points: Tensor) -> tuple[Tensor, Tensor, Shade]:
        """Evaluate level 1 everywhere and the residual in its band, with a graph of everything."""
        for weights in self.levels:
            for weight in weights:
                weight.requires_grad_()
        at = points.requires_grad_()
        f, coarse = self._value(0, at)
        inside = torch.nonzero(f.detach().abs() < DELTAS[0])[:, 0]
        residual, fine = self._value(1, at[inside])
        f = f.index_add(0, inside, residual)
        features = torch.cat((coarse, fine.new_zeros(len(points), fine.shape[1]).index_add(0, inside, fine)), dim=1)
        gradient = torch.autograd.grad(f.sum(), at, create_graph=True)[0]

        def shade(index: Tensor, directions: Tensor, slope: Tensor) -> Tensor:
            colors: Tensor = self.radiance(points[index].detach(), directions, slope, features[index])
            return colors

        return f, gradient, shade

    def _value(self, index: int, points: Tensor) -> tuple[Tensor, Tensor]:
        """Evaluate a network in PyTorch's own operations, (N,), and its last hidden layer, (N, width)."""
        weights, hidden = self.levels[index], points
        for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
            hidden = torch.addmm(bias, hidden, weight.t()).sin()
        return torch.addmm(weights[-1], hidden, weights[-2].t())[:, 0], hidden

    def backward(self, loss: Tensor) -> None:
        """Differentiate twice."""
        loss.backward()  # type: ignore[no-untyped-call]


class NeusField:
    """NeuS's distance as a field to extract."""

    chunk = 16_384

    def __init__(self, scene: NeusScene) -> None:
        self._scene = scene

    def value(self, points: Array) -> Array:
        """Evaluate it; outside the unit ball, where nothing was trained, at least the ball's distance."""
        f = self._scene.guide(torch.from_numpy(points)).numpy()
        return np.asarray(np.maximum(f, np.linalg.norm(points, axis=1) - 1), np.float32)

    def clearance(self, points: Array) -> Array:
        """Return 0: no bound is known."""
        return np.zeros(len(points), np.float32)


def learn(contender: Contender, seconds: float, clock: Callable[[], float] = time.process_time) -> int:
    """Train for some seconds of a clock, by default processor time; return the steps."""
    began, steps = clock(), 0
    while (share := (clock() - began) / seconds) < 1:
        contender.step(share)
        steps += 1
    return steps


def cost_of_a_step(scene: MultiscaleScene, rays: Rays, count: int) -> float:
    """Measure the processor seconds of a step of a new scene with all its levels: the median of STEPS."""
    scene.become_sphere(SEED)
    learner, times = Learner(scene, rays, count, 0.0, SEED), []
    for _ in range(STEPS):
        began = time.process_time()
        learner.step(0.5)
        times.append(time.process_time() - began)
    return statistics.median(times)
