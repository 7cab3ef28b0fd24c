"""Batches of a training step, and its loss and derivative by torch.autograd in 64 bits."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from mplicits.trainer.config import LossWeights
from mplicits.trainer.level import level_loss
from mplicits.trainer.networks.network import initial, value
from mplicits.trainer.texture import texture_loss
from mplicits.trainer.training_samples import Pool

COUNT, ON, HARD = 128, 64, 10
"""Samples of a batch, the first of them that lie on the surface, and the last of them that are hard examples."""
WEIGHT = LossWeights(100.0, 10.0, 3.0, 40.0, excess=4.0, lacking=2.5, length=1.7, near=0.05)
SMOOTHNESS = 0.02


@dataclass(frozen=True)
class Truth:
    """Results of a step. A level's `values` are f (COUNT,), a texture's colors (COUNT, 3)."""

    gradient: tuple[Tensor, ...]
    loss: float
    terms: list[float]
    values: Tensor
    slope: Tensor | None = None


def network(width: int, depth: int, outputs: int) -> list[Tensor]:
    """Return random weights for inputs (x, y, z, time)."""
    weights = initial((width, depth), 30.0, outputs, torch.Generator().manual_seed(width), moving=True)
    return [w.double().requires_grad_() for w in weights]


def packed(weights: list[Tensor]) -> np.ndarray:
    """Return weights in the kernels' order."""
    return np.concatenate([w.detach().numpy().astype(np.float32).ravel() for w in weights])


def unpacked(gradient: np.ndarray, weights: list[Tensor]) -> list[np.ndarray]:
    """Return a gradient in the shapes of the weights."""
    parts = np.split(gradient, np.cumsum([w.numel() for w in weights])[:-1])
    return [part.reshape(w.shape) for part, w in zip(parts, weights, strict=True)]


def level_samples() -> np.ndarray:
    """Return samples (COUNT, 12): point, time, f and grad f of the levels before, distance, normal."""
    samples = np.random.default_rng(1).uniform(-1, 1, (COUNT, 12))
    samples[:, 4:9] *= 0.3
    samples[:ON, 8] *= 0.01
    samples[[3, -3], 8] = np.nan
    samples[:, 9:] /= np.linalg.norm(samples[:, 9:], axis=1, keepdims=True)
    samples[ON:-HARD, 9:] = 0
    return samples.astype(np.float32)


def texture_samples() -> np.ndarray:
    """Return samples (COUNT, 12): point, time, direction (4), color, unused."""
    samples = level_samples()
    samples[:, 8:11] = np.abs(samples[:, 9:])
    return samples


def level_truth(weights: list[Tensor], samples: np.ndarray) -> Truth:
    """Take a level's step."""
    rows = torch.from_numpy(samples.astype(np.float64))
    points = rows[:, :4].clone().requires_grad_()
    f = value(weights, points)[:, 0]
    (slope,) = torch.autograd.grad(f.sum(), points, create_graph=True)
    gradient = slope + torch.cat((rows[:, 5:8], torch.zeros(COUNT, 1)), dim=1)
    told = rows[:, 8].clone()
    told[-HARD:] = torch.nan  # The loss does not tell of hard examples.
    pools = [Pool(points, distance, rows[:, 9:], rows[:, 4], rows[:, 5:8]) for distance in (rows[:, 8], told)]
    with torch.no_grad():
        (_, d_f, d_gradient, _), (_, _, _, terms) = (
            level_loss(f + rows[:, 4], gradient, pool.take(slice(ON)), pool.take(slice(ON, None)), WEIGHT)
            for pool in pools
        )
    loss = sum(float(term) * getattr(WEIGHT, name) for name, term in terms.items())
    derivative = torch.autograd.grad((f, slope), weights, (d_f, d_gradient))
    return Truth(derivative, loss, [float(term) for term in terms.values()], f.detach(), slope.detach())


def texture_truth(weights: list[Tensor], samples: np.ndarray) -> Truth:
    """Take a texture's step."""
    rows = torch.from_numpy(samples.astype(np.float64))
    points, directions, truth = rows[:, :4].clone().requires_grad_(), rows[:, 4:8], rows[:ON, 8:11]
    colors = value(weights, points)
    slopes = [torch.autograd.grad(channel.sum(), points, create_graph=True)[0] for channel in colors.T]
    along = torch.stack([(slope * directions).sum(1) for slope in slopes], dim=1)
    with torch.no_grad():
        _, d_colors, d_along, terms = texture_loss(colors, along.clone(), truth, SMOOTHNESS)
    color, change = (float(term) for term in terms.values())
    derivative = torch.autograd.grad((colors, along), weights, (d_colors, d_along))
    return Truth(derivative, color + SMOOTHNESS * change, [color, change], colors.detach())


def assert_near(ours: list[np.ndarray], truth: tuple[Tensor, ...]) -> None:
    """Compare gradients, to 1e-5 of the largest entry of each weight's."""
    for one, expected in zip(ours, truth, strict=True):
        np.testing.assert_allclose(one, expected.numpy(), atol=1e-5 * expected.abs().max().item())
