"""Ways to train a neural SDF of a mesh in a number of seconds, for the tables that compare them.

All of them run on the CPU, in one process, with the settings of `trainer.machine`. `paper` and `unnested` see only the
mesh's vertices with normals, as in the paper; the others see exact distances as well.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor
from torch.nn import functional

from mplicits.mesher.model_field import Field, ModelField
from mplicits.mesher.surface_line import loose_components
from mplicits.model.model import DEFAULT_ITERATIONS, Level, Model
from mplicits.trainer import held_out_errors, sampling, settings
from mplicits.trainer.held_out_errors import delta
from mplicits.trainer.networks.nested import field, in_band
from mplicits.trainer.networks.network import Weights, initial, to_model
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.shape import Doubles, Shape, SurfacePoints, unit
from mplicits.trainer.suited_omegas import suited_omegas
from mplicits.trainer.train import Training

BATCH = 8192
"""Samples of a step."""
RATE = 1e-4
"""Rate of Adam in SIREN and in the paper's release; our trainer has its own schedule."""
EVERYWHERE = 1e3
"""A delta that makes the whole domain a band."""
POOL = 200_000
"""Samples on the surface, and as many off it."""
AROUND = 8
"""Surface samples whose mean normal is a vertex's normal."""


@dataclass(frozen=True)
class Trained:
    """The result of a contender."""

    name: str
    """In the table."""
    parameters: int
    """Number of weights and biases."""
    seconds: float
    """Of training."""
    steps: tuple[int, ...]
    """Optimizer steps of each network."""
    field: Callable[[float], Field]
    """Makes the field for a grid whose cells have this diagonal, model units."""


def of_model(name: str, model: Model, seconds: float, steps: Sequence[int] = ()) -> Trained:
    """Describe a contender whose result is a model. steps: where they are not in the model's provenance."""
    recorded = tuple(record["steps"] for record in model.provenance.get("levels", []))
    return Trained(name, model.parameters(), seconds, tuple(steps) or recorded, lambda cell: ModelField(model, cell))


def training_settings(levels: str, steps: str | None = None, seconds: float | None = None, seed: int = 0) -> Settings:
    """Return the settings of `mplicits train --texture none` with these options.

    levels, steps: as the command line takes them; steps None: the default, or as many as the seconds allow.
    """
    networks = settings.networks(levels)
    chosen = settings.steps(steps, len(networks))
    return Settings(networks, settings.omegas(None, networks), chosen, seconds, texture=False, seed=seed)


def ours(shape: Shape, networks: str, seconds: float, seed: int) -> Model:
    """Train as `mplicits train SHAPE --levels NETWORKS --seconds S --texture none` does."""
    return trained(shape, training_settings(networks, seconds=seconds, seed=seed))


def trained(shape: Shape, chosen: Settings, began: float | None = None) -> Model:
    """Train as `mplicits train` does. chosen: with the default omegas, which follow the shape.

    began: time.perf_counter() at which the seconds of `chosen` start; None: now.
    """
    suited = replace(chosen, omegas=suited_omegas(shape, chosen.networks))
    return Training(shape, suited, TrainingBar(quiet=True), began, components=loose_components).run()


def one_siren(shape: Shape, parameters: int, seconds: float, seed: int) -> Model:
    """Train one network of two hidden layers and at most `parameters` weights by our loss and schedule.

    Values above the distance weigh no more than others, since no other level relies on this network.
    """
    width = max(n for n in range(4, 1025) if 4 * n + 2 * (n * n + n) + n + 1 <= parameters)
    chosen = Settings(((width, 2),), (60.0,), (1,), seconds, False, seed, weights={"excess": 1.0})
    return Training(shape, chosen, TrainingBar(quiet=True)).run()


class Siren:
    """A SIREN in its authors' form, sin(omega_0 (W x + b)), with omega_0 outside the weights."""

    def __init__(self, size: tuple[int, int], omega: float, generator: torch.Generator) -> None:
        folded = initial(size, omega, 1, generator)
        self.omega = omega
        self.weights = [(w / omega if i < len(folded) - 2 else w).requires_grad_() for i, w in enumerate(folded)]

    def __call__(self, points: Tensor) -> Tensor:
        for weight, bias in zip(self.weights[:-2:2], self.weights[1:-2:2], strict=True):
            points = torch.sin(self.omega * functional.linear(points, weight, bias))
        return functional.linear(points, self.weights[-2], self.weights[-1])[:, 0]

    def folded(self) -> Weights:
        """Return the weights with omega_0 folded in."""
        last = len(self.weights) - 2
        return [(w.detach() * self.omega if i < last else w.detach()).clone() for i, w in enumerate(self.weights)]


Loss = Callable[[Tensor, Tensor, Tensor, Tensor], Tensor]
"""(f, distance, cosine of gradient and normal, norms of the gradient) -> loss.

f, distance and norms: at points of the surface, then at as many points around it. cosine: at points of the surface.
A distance of NaN is unknown.
"""


def eq4(f: Tensor, distance: Tensor, cosine: Tensor, norms: Tensor) -> Tensor:
    """Compute Eq. 4 with the weights of the paper's release: SDF 3000, normal 100, gradient 50."""
    known = ~distance.isnan()
    value = (f[known] - distance[known]).square().mean()
    return 3000 * value + 100 * (1 - cosine).mean() + 50 * (norms - 1).square().mean()


def siren_loss(f: Tensor, distance: Tensor, cosine: Tensor, norms: Tensor) -> Tensor:
    """Compute SIREN's own loss (Sitzmann et al. 2020, section 4.2), which keeps the surface away from other points."""
    on, around = f.chunk(2)
    away = torch.exp(-100 * around.abs()).mean()
    return 3000 * on.abs().mean() + 100 * away + 100 * (1 - cosine).mean() + 50 * (norms - 1).abs().mean()


def paper(shape: Shape, networks: str, omegas: tuple[float, ...], seconds: float, seed: int) -> tuple[Model, list[int]]:
    """Train by the paper's recipe: vertices and normals, Eq. 4, adaptive nested bands, autograd, all levels each step.

    Returns the model, and the steps of each network. Level 1 also learns the distance to the nearest vertex in the
    whole domain: the Eikonal term of Eq. 4 allows surfaces far from the cloud, and the Chamfer distance was 0.27.
    """
    return _trained(shape, networks, omegas, seconds, seed, eq4, nested=True)


def unnested(
    shape: Shape, networks: str, omegas: tuple[float, ...], seconds: float, seed: int
) -> tuple[Model, list[int]]:
    """Train the baseline of Section 4.2: the same sum, each network by SIREN's loss in the whole domain.

    Returns the model, and the steps of each network.
    """
    return _trained(shape, networks, omegas, seconds, seed, siren_loss, nested=False)


def _trained(
    shape: Shape, networks: str, omegas: tuple[float, ...], seconds: float, seed: int, loss: Loss, nested: bool
) -> tuple[Model, list[int]]:
    """Train the networks one after another, each for an equal share of the seconds.

    nested: in the earlier bands, not in the whole domain. Returns the model, and the steps of each network.
    """
    began = time.perf_counter()
    sizes = settings.networks(networks)
    generator, rng = torch.Generator().manual_seed(seed), np.random.default_rng(seed)
    sirens: list[Siren] = []
    deltas: list[float] = []
    steps: list[int] = []
    slopes: list[float] = []
    cloud = _cloud(shape)
    for i, (size, omega) in enumerate(zip(sizes, omegas, strict=True)):
        sirens.append(Siren(size, omega, generator))
        done = [siren.folded() for siren in sirens[:-1]]
        batches = _batches(cloud, done, deltas if nested else [], rng)
        optimizer = torch.optim.Adam(sirens[-1].weights, RATE)
        count = 0
        while time.perf_counter() - began < seconds * (i + 1) / len(sizes):
            points, normals, distance = next(batches)
            points.requires_grad_()
            f = torch.stack([siren(points) for siren in sirens]).sum(dim=0)
            gradient = torch.autograd.grad(f.sum(), points, create_graph=True)[0]
            on = len(normals)
            cosine = functional.cosine_similarity(gradient[:on], normals, dim=1)
            total = loss(f, distance, cosine, torch.linalg.vector_norm(gradient, dim=1))
            optimizer.zero_grad()
            total.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            count += 1
        steps.append(count)
        for weight in sirens[-1].weights:
            weight.requires_grad_(False)
        done = [siren.folded() for siren in sirens]
        at = torch.from_numpy(cloud.points.astype(np.float32))
        deltas.append(delta(field(done, at)) if nested else EVERYWHERE)
        spread = torch.rand(POOL, 3, generator=generator) * 2 - 1
        slopes.append(held_out_errors.lipschitz(done, torch.cat((at, spread if i == 0 or not nested else at))))
    levels = [
        Level(to_model(siren.folded()), width, DEFAULT_ITERATIONS[min(i, 1)], slope)
        for i, (siren, width, slope) in enumerate(zip(sirens, deltas, slopes, strict=True))
    ]
    return Model(shape.name, tuple(levels)), steps


def _cloud(shape: Shape) -> SurfacePoints:
    """Take the mesh's vertices, each with the mean normal of the `AROUND` samples of the surface closest to it."""
    points = shape.inputs()
    drawn = shape.surface(AROUND * len(points), np.random.default_rng(0))
    close = cKDTree(drawn.points).query(points, k=AROUND, workers=-1)[1]
    return SurfacePoints(points, unit(drawn.normals[close].sum(axis=1)))


def offsets(points: Doubles, directions: Doubles, largest: float, clearance: Callable[[Doubles], Doubles]) -> Doubles:
    """Find how far each surface point can move along its normal and stay the closest surface point (Fig. 3b).

    points: (N, 3). directions: (N, 3), unit normals. clearance: unsigned distance to the surface. Returns t (N,): the
    largest t_j <= `largest`, in tenths of it, at which points_j + t_j directions_j is at distance t_j within 1 %.
    """
    t = np.full(len(points), largest)
    short = np.arange(len(points))
    for tenths in range(9, -1, -1):
        distance = clearance(points[short] + t[short, None] * directions[short])
        short = short[distance < 0.99 * t[short]]
        if not len(short):
            break
        t[short] = largest * tenths / 10
    return t


def _batches(
    cloud: SurfacePoints, done: list[Weights], deltas: list[float], rng: np.random.Generator
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Draw endless batches: points on the surface, then as many around it; normals of the surface points; distances.

    done: earlier levels. deltas: of their bands; empty: the whole domain. Unknown distances are NaN.
    """
    half, tree = BATCH // 2, cKDTree(cloud.points)
    rounds = -(-POOL // len(cloud.points))  # each vertex as often as the others
    chosen = np.concatenate([rng.permutation(len(cloud.points)) for _ in range(rounds)])[:POOL]
    on, normals = cloud.points[chosen], cloud.normals[chosen]
    t = np.zeros(POOL)
    if deltas:

        def inside(points: Doubles) -> NDArray[np.bool_]:
            return np.asarray(in_band(done, deltas, torch.from_numpy(points.astype(np.float32))).numpy())

        def clearance(points: Doubles) -> Doubles:
            return np.asarray(tree.query(points, workers=-1)[0])

        moved = slice(0, POOL // 4)
        t[moved] = offsets(on[moved], normals[moved], deltas[-1], clearance) * rng.random(POOL // 4)
        around = sampling.dithered(cloud.points, deltas[-1], inside, POOL, rng)
    else:
        around = sampling.domain(POOL, rng)
    far = np.full(POOL, np.nan)
    if not done:
        distance, nearest = tree.query(around, workers=-1)
        behind = np.einsum("ij,ij->i", around - cloud.points[nearest], cloud.normals[nearest]) < 0
        far = np.where(behind, -distance, distance)
    on = on + t[:, None] * normals
    surface, directions, offset, volume, known = (
        torch.from_numpy(array.astype(np.float32)) for array in (on, normals, t, around, far)
    )
    while True:
        one, other = (torch.from_numpy(rng.integers(POOL, size=half)) for _ in range(2))
        yield torch.cat((surface[one], volume[other])), directions[one], torch.cat((offset[one], known[other]))
