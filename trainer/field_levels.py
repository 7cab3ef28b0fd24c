"""Measurements of trained networks: zero level set, bands and step bounds. They make networks the levels of a model."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from ..model.errors import UserError
from ..model.model import DEFAULT_ITERATIONS, Level, Network
from . import tracing
from .held_out_errors import delta, lipschitz
from .networks.nested import field, field_and_gradient
from .networks.network import Weights, from_model

POINTS, FEWEST_POINTS = 100_000, 10_000
"""Most and fewest starting points of the search for a zero level set."""
WORK = 2e10
"""Largest product of weights and starting points, unless these are the fewest."""
NEWTON = 8
"""Newton steps towards a zero level set."""
NEAR = 1e-3
"""Largest |f| of a point on it."""
FEWEST = 1000
"""Fewest points that must reach it."""
FLATTEST = 1e-2
"""Least squared length of a gradient in a Newton step."""
LARGEST_NORM = 1.02
"""Largest norm of a point in the unit ball."""


def measured_levels(
    networks: Sequence[Network], surface: Tensor, points: Tensor, known: Sequence[float] = ()
) -> tuple[Level, ...]:
    """Return the levels of networks, coarse to fine.

    surface: (N, 3), points from which the bands are computed (Eq. 5). points: (M, 3), on the last level's zero level
    set. known: half-widths delta of the first levels' bands, which are then not measured.
    """
    levels = [from_model(network) for network in networks]
    first, finer = DEFAULT_ITERATIONS
    measured: list[Level] = []
    for i, network in enumerate(networks):
        around = _around(levels[:i], points, measured[-1].delta if measured else None)
        width = known[i] if i < len(known) else delta(field(levels[: i + 1], surface))
        deltas = [*(level.delta for level in measured), width]
        traced = tracing.measure(levels[: i + 1], deltas, points)
        measured.append(
            Level(
                network,
                delta=width,
                iterations=finer if i else first,
                lipschitz=max(lipschitz(levels[: i + 1], torch.cat((points, around))), traced.lipschitz),
                step_bound=traced.step_bounds[-1],
                band_step_bound=1.0,
            )
        )
        measured[:-1] = [
            replace(level, band_step_bound=min(level.band_step_bound, bound))
            for level, bound in zip(measured[:-1], traced.step_bounds[:-1], strict=True)
        ]
    return tuple(measured)


def zero_set(levels: Sequence[Weights]) -> Tensor:
    """Find points of the unit ball where the last level is zero: where f_1 = 0, from there where f_2 = 0, and so on.

    Returns (N, 3) float32. Raises UserError where too few points reach the zero level set.
    """
    weights = sum(w.numel() for level in levels for w in level)
    count = int(np.clip(WORK / weights, FEWEST_POINTS, POINTS))
    directions = np.random.default_rng(0).normal(size=(count, 4))
    points = torch.from_numpy((directions[:, :3] / np.linalg.norm(directions, axis=1)[:, None]).astype(np.float32))
    for i in range(len(levels)):
        for _ in range(NEWTON):
            f, gradient = field_and_gradient(levels[: i + 1], points)
            points = points - (f / gradient.square().sum(dim=1).clamp_min(FLATTEST))[:, None] * gradient
        f, _ = field_and_gradient(levels[: i + 1], points)
        points = points[(f.abs() < NEAR) & (torch.linalg.vector_norm(points, dim=1) < LARGEST_NORM)]
        if len(points) < FEWEST:
            raise UserError(f"level {i + 1} has no surface" + " near that of the level before" * (i > 0))
    return points


def _around(before: Sequence[Weights], points: Tensor, band: float | None) -> Tensor:
    """Draw points in the domain of a level: in the unit ball, or in the band |f| < `band` of the levels `before`.

    points: (N, 3), on the surface. band: None for level 1. Returns (N, 3).
    """
    generator = torch.Generator().manual_seed(0)
    share = 2 * torch.rand(len(points), 1, generator=generator) - 1
    if band is None:
        inside: Tensor = torch.nn.functional.normalize(points) * share.abs().pow(1 / 3)
        return inside
    _, gradient = field_and_gradient(before, points)
    steps: Tensor = share * band * torch.nn.functional.normalize(gradient, dim=1)
    return points + steps
