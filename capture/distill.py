"""Turns a trained scene into a model: measures its levels, and distills its colors into a texture network."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import normalize

from ..model.errors import UserError
from ..model.model import DEFAULT_ITERATIONS, Level, Model, Network
from ..trainer import texture
from ..trainer.config import default_config
from ..trainer.field_levels import zero_set
from ..trainer.networks.callback import Report, TrainingProgress
from ..trainer.networks.fit import Budget, Task, fit
from ..trainer.networks.nested import field_and_gradient, in_band
from ..trainer.networks.network import Weights, to_model
from ..trainer.settings import default_texture
from ..trainer.training_samples import Pool
from .photographs import Photograph, Photographs
from .radiance import Radiance

FACING = 0.2  # least cosine between the normal and the direction to a camera that contributes to a point's color
CAMERAS = 24  # most cameras that contribute
CHUNK = 16_384


def unfinished_levels(levels: Sequence[Weights], deltas: Sequence[float]) -> tuple[Level, ...]:
    """Convert levels without measuring them, for an interrupted run. deltas: band half-widths of all levels."""
    first, finer = DEFAULT_ITERATIONS
    return tuple(Level(to_model(w), deltas[i], finer if i else first) for i, w in enumerate(levels))


def surface_of(levels: Sequence[Weights], deltas: Sequence[float]) -> Tensor:
    """Find points (N, 3) on the last level's zero set inside its band. Raises UserError if there are too few."""
    try:
        points = zero_set(levels)
        points = points[in_band(levels[:-1], deltas[: len(levels) - 1], points)]
        reason = f"the zero set of level {len(levels)} lies outside the bands"
    except UserError as error:
        points, reason = torch.empty(0, 3), str(error)
    if not len(points):
        raise UserError(f"no surface in the photographs ({reason}); check the cameras, or set --steps or --sphere")
    return points


def distilled(
    levels: Sequence[Weights],
    delta: float,
    surface: Tensor,
    features: Tensor,
    radiance: Radiance,
    views: Sequence[Photograph],
    progress: TrainingProgress,
    seed: int,
) -> Network:
    """Train the texture network on the surface's colors, averaged over the cameras.

    delta: half-width of the band in which colors are constant along normals. surface: (N, 3). features: (N, F), of the
    surface, for `radiance`. All tensors are on the CPU.
    """
    config, lengths = default_config().texture, default_config().lengths
    size = default_texture((levels[-1][0].shape[0], len(levels[-1]) // 2 - 2))
    progress.begin(f"texture ({size[0]}x{size[1]})")
    _, gradient = field_and_gradient(levels, surface)
    on = _pool(surface, gradient, colors_of_surface(surface, gradient, features, radiance, views))
    generator = torch.Generator().manual_seed(seed)
    shift = delta * (2 * torch.rand(len(surface), 1, generator=generator) - 1)
    beside = surface + shift * normalize(gradient, dim=1)
    step = texture.TextureStep(on, _pool(beside, field_and_gradient(levels, beside)[1]), generator)
    task = Task(
        start=lambda: texture.initial_texture(size, lengths.texture_omega, seed, torch.device("cpu")),
        step=step,
        idle=texture.idle_loss(on),
        rate=config.rate,
        output_factor=config.output_factor,
    )
    outcome = fit(task, Budget(steps=lengths.texture_steps), progress.say, [Report(progress)])
    progress.end()
    return to_model(outcome.weights)


@torch.no_grad()
def colors_of_surface(
    points: Tensor, gradient: Tensor, features: Tensor, radiance: Radiance, views: Sequence[Photograph]
) -> Tensor:
    """Average the radiance along the normal and towards the cameras that face a point.

    points: (N, 3), on the surface. gradient (N, 3), features (N, F): of the field. Returns sRGB (N, 3), in [0, 1].
    """
    stride = max(1, len(views) // CAMERAS)
    eyes = torch.from_numpy(np.stack([view.eye for view in views[::stride]])).float()
    parts = []
    for k in range(0, len(points), CHUNK):
        at, slope, known = (column[k : k + CHUNK] for column in (points, gradient, features))
        normals = normalize(slope, dim=1)
        total, count = radiance(at, -normals, slope, known), torch.ones(len(at), 1)
        for eye in eyes:
            sight = normalize(at - eye, dim=1)
            facing = torch.nonzero((sight * normals).sum(dim=1) < -FACING)[:, 0]
            if len(facing):
                total[facing] += radiance(at[facing], sight[facing], slope[facing], known[facing])
                count[facing] += 1
        parts.append(total / count)
    return torch.cat(parts)


def _pool(points: Tensor, gradient: Tensor, colors: Tensor | None = None) -> Pool:
    return Pool(points, None, None, points.new_zeros(len(points)), gradient, colors)


def model_of(
    photographs: Photographs, levels: tuple[Level, ...], color: Network | None, provenance: dict[str, Any]
) -> Model:
    """Assemble the model. color: the texture network."""
    return Model(
        name=photographs.name,
        levels=levels,
        texture=color,
        center=photographs.center,
        scale=photographs.scale,
        up=photographs.up,
        front=photographs.front(),
        credit=str(provenance["settings"]["credit"]),
        provenance=provenance,
    )
