"""What was learnt from photographs becomes a model: its bands and bounds are measured, its colours distilled."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import normalize

from ..model.errors import UserError
from ..model.model import DEFAULT_ITERATIONS, Level, Model, Network
from ..trainer import texture
from ..trainer.measured import measured_levels, zero_set
from ..trainer.networks.fit import Budget, Task, TrainingProgress, fit
from ..trainer.networks.nested import field_and_gradient, in_band
from ..trainer.networks.network import Weights, to_model
from ..trainer.pools import Pool
from ..trainer.settings import TEXTURE_DEEPEST, TEXTURE_OMEGA, TEXTURE_STEPS, TEXTURE_WIDEST
from .posed import Photographs, Posed
from .radiance import Radiance

LAST_BAND = 0.02
"""Half width of the last level's band in a file of a training that is not over, where nothing is measured."""
FACING = 0.2
"""Cosine of the angle to the normal from which on a camera counts for the colour of a point."""
CAMERAS = 24
"""Most cameras that do."""
CHUNK = 16_384


def unfinished_model(
    photographs: Photographs, levels: Sequence[Weights], deltas: Sequence[float], provenance: dict[str, Any]
) -> Model:
    """Put together what is learnt so far; nothing is measured."""
    first, finer = DEFAULT_ITERATIONS
    widths = [*deltas[: len(levels) - 1], LAST_BAND]
    return _model(
        photographs,
        tuple(Level(to_model(w), widths[i], finer if i else first) for i, w in enumerate(levels)),
        None,
        provenance,
    )


def finished_model(
    photographs: Photographs,
    levels: Sequence[Weights],
    deltas: Sequence[float],
    colour: Network | None,
    surface: Tensor,
    provenance: dict[str, Any],
) -> Model:
    """Measure the levels and put the model together.

    deltas: half widths of all bands. colour: the texture. surface: (N, 3), of `surface_of`.
    """
    measured = measured_levels([to_model(w) for w in levels], surface, surface, deltas)
    return _model(photographs, measured, colour, provenance)


def surface_of(levels: Sequence[Weights], deltas: Sequence[float]) -> Tensor:
    """Find points (N, 3) where the last level is zero, and is the answer. Raises UserError where there are too few."""
    try:
        points = zero_set(levels)
        points = points[in_band(levels[:-1], deltas[: len(levels) - 1], points)]
        if len(points):
            return points
    except UserError:
        pass
    raise UserError("no surface was found in the photographs; are the cameras right? Give more --steps, or --sphere")


def distilled(
    levels: Sequence[Weights],
    delta: float,
    surface: Tensor,
    features: Tensor,
    radiance: Radiance,
    views: Sequence[Posed],
    progress: TrainingProgress,
    seed: int,
) -> Network:
    """Train the texture network on what the cameras see of the surface; its colours do not depend on the view.

    delta: half width of the band in which colours are kept constant along normals. surface: (N, 3). features: (N, F),
    of the surface's points, which `radiance` takes. Everything is on the CPU.
    """
    width, depth = levels[-1][0].shape[0], len(levels[-1]) // 2 - 2
    size = min(width, TEXTURE_WIDEST), min(depth, TEXTURE_DEEPEST)
    progress.begin(f"texture ({size[0]}x{size[1]})")
    _, gradient = field_and_gradient(levels, surface)
    on = _pool(surface, gradient, colours_of_surface(surface, gradient, features, radiance, views))
    generator = torch.Generator().manual_seed(seed)
    shift = delta * (2 * torch.rand(len(surface), 1, generator=generator) - 1)
    beside = surface + shift * normalize(gradient, dim=1)
    step = texture.TextureStep(on, _pool(beside, field_and_gradient(levels, beside)[1]), generator)
    task = Task(
        start=texture.start(size, TEXTURE_OMEGA, seed, torch.device("cpu")),
        step=step,
        idle=texture.idle_loss(on),
        rate=texture.RATE,
        output_factor=texture.OUTPUT_FACTOR,
    )
    outcome = fit(task, Budget(steps=TEXTURE_STEPS), progress)
    progress.end()
    return to_model(outcome.weights)


@torch.no_grad()
def colours_of_surface(
    points: Tensor, gradient: Tensor, features: Tensor, radiance: Radiance, views: Sequence[Posed]
) -> Tensor:
    """Average the radiance along the normal and towards the cameras that face a point.

    points: of the surface, (N, 3). gradient (N, 3), features (N, F): of the field. Returns sRGB (N, 3), in [0, 1].
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
                seen = radiance(at[facing], sight[facing], slope[facing], known[facing])
                total[facing] += seen
                count[facing] += 1
        parts.append(total / count)
    return torch.cat(parts)


def _pool(points: Tensor, gradient: Tensor, colours: Tensor | None = None) -> Pool:
    return Pool(points, None, None, points.new_zeros(len(points)), gradient, colours)


def _model(
    photographs: Photographs, levels: tuple[Level, ...], colour: Network | None, provenance: dict[str, Any]
) -> Model:
    return Model(
        name=photographs.name,
        levels=levels,
        texture=colour,
        centre=photographs.centre,
        scale=photographs.scale,
        up=photographs.up,
        front=photographs.front(),
        credit=str(provenance["settings"]["credit"]),
        provenance=provenance,
    )
