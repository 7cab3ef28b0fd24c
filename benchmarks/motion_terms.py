"""Compares ways to say what a motion is between its ends: writes docs/results/motion_terms.md.

    python benchmarks/motion_terms.py A.obj B.obj [--levels 96x2] [--steps 2000] [-o FILE]

One network, which sees its whole domain, learns the same two ends in each way with the same steps and weights, and in
between:

- arrival times: the surfaces of trainer/shapes/between.py, as `morph` does;
- blend: the surfaces of (1 - t) f_A + t f_B;
- nothing: the Eikonal term alone;
- level-set equation: df/dt = v |grad f| with the velocity v = c (f_B - f) exp(-f^2), which Novello et al. (2023) have
  for an interpolation, beside the Eikonal term.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from contenders import training_settings
from motion import FRAMES, RESOLUTION, error, slopes
from mplicits.mesher.extract import extract_model
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.trainer import level, motion, sampling
from mplicits.trainer.motion import ModelSurface, morph_loader
from mplicits.trainer.pools import Pool
from mplicits.trainer.session import TrainingBar
from mplicits.trainer.settings import LossWeights
from mplicits.trainer.shapes import motion as shapes_motion
from mplicits.trainer.shapes.between import Between, Grid, between, blended, distances, interpolated
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.motion import MovingShape
from mplicits.trainer.shapes.shape import Doubles, SurfacePoints
from mplicits.trainer.train import Training
from protocol import Page, machine

VELOCITIES = (3.0, 10.0)
"""Values of c."""
LEVEL_SET = 100.0
"""Weight of the level-set equation."""
ENDS = 1e-6
"""A sample is of an end where its time is nearer to it than this."""

Loss = Callable[[Tensor, Tensor, Pool, Pool, LossWeights], tuple[Tensor, Tensor, Tensor, dict[str, Tensor]]]


class Ends(MovingShape):
    """A motion of which only the two ends are known; distances in between are NaN, which teach nothing."""

    def surface(
        self, count: int, rng: np.random.Generator, *, held_out: bool = False, colours: bool = False
    ) -> SurfacePoints:
        """Draw points of the two ends."""
        halves = [
            self._surfaces[k].surface(n, rng, held_out=held_out) for k, n in ((0, count - count // 2), (-1, count // 2))
        ]
        times = np.repeat([0.0, 1.0], [len(half.points) for half in halves])
        points = np.column_stack((np.concatenate([half.points for half in halves]), times))
        order = rng.permutation(count)
        return SurfacePoints(points[order], np.concatenate([half.normals for half in halves])[order], None)

    def inputs(self) -> Doubles:
        """Return the ends' own points."""
        points = super().inputs()
        return points[(points[:, 3] < ENDS) | (points[:, 3] > 1 - ENDS)]

    def distance(self, points: Doubles) -> Doubles:
        """Compute the signed distance at points (N, 4): NaN in between."""
        known = np.full(len(points), np.nan)
        for moment, time in ((self._surfaces[0], 0.0), (self._surfaces[-1], 1.0)):
            at = np.abs(points[:, 3] - time) < ENDS
            if at.any():
                known[at] = moment.distance(points[at, :3])
        return known


def timed_at_ends(points: Doubles, moving: bool, rng: np.random.Generator) -> Doubles:
    """Give points (N, 3) a time: a third of them each end's, and the others a uniform one in between."""
    assert moving
    chosen = rng.integers(3, size=len(points))
    return np.column_stack((points, np.where(chosen == 2, rng.random(len(points)), chosen)))


def with_level_set(usual: Loss, second: Grid, speed: float) -> Loss:
    """Return the loss of a level with the level-set equation at the samples off the surface."""

    def loss(
        f: Tensor, gradient: Tensor, surface: Pool, volume: Pool, weight: LossWeights
    ) -> tuple[Tensor, Tensor, Tensor, dict[str, Tensor]]:
        total, d_f, d_gradient, terms = usual(f, gradient, surface, volume, weight)
        on = len(surface.points)
        aim = interpolated(second, np.asarray(volume.points[:, :3], np.float64))
        value, slope = f[on:].detach().requires_grad_(), gradient[on:].detach().requires_grad_()
        velocity = speed * (torch.from_numpy(aim).float() - value) * torch.exp(-value.square())
        left = slope[:, 3] - velocity * slope[:, :3].norm(dim=1)
        term = LEVEL_SET * left.square().mean()
        d_value, d_slope = torch.autograd.grad(term, (value, slope))
        d_f[on:] += d_value
        d_gradient[on:] += d_slope
        return total + term.detach(), d_f, d_gradient, terms

    return loss


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("meshes", type=Path, nargs=2)
    parser.add_argument("--levels", default="96x2")
    parser.add_argument("--steps", default="2000")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/motion_terms.md"))
    options = parser.parse_args()
    first, second = options.meshes
    page = Page(
        options.output,
        "# What a motion is between its ends",
        "",
        f"Printed by `python benchmarks/motion_terms.py {first.name} {second.name} --levels {options.levels} --steps "
        f"{options.steps}`, {machine()}.",
        "",
        f"`{first.name}` becomes `{second.name}`; what the rows are stands at the head of that script. Hausdorff: of "
        f"the surfaces of frames 1/60 of the time apart. Pieces: components of a frame's surface. Ends: Chamfer "
        "distance x 1e6 at time 0 and 1. Gradient: share of the last level's band, at random times, in which |grad f| "
        "is within 0.5 to 1.5.",
        "",
        "| in between | Hausdorff, median | largest / median | frames of no surface | of more than one piece "
        "| most pieces | ends | gradient |",
        "|---|---:|---:|---:|---:|---:|---|---:|",
    )
    grid = distances(load_shape(str(second), crease=30.0)[0])
    usual = level.level_loss
    ways: list[tuple[str, type[MovingShape], Callable[[Grid, Grid], Between], Loss]] = [
        ("arrival times", MovingShape, between, usual),
        ("blend", MovingShape, blended, usual),
        ("nothing", Ends, between, usual),
        *(
            (f"level-set equation, c = {speed:g}", Ends, between, with_level_set(usual, grid, speed))
            for speed in VELOCITIES
        ),
    ]
    for name, kind, change, loss in ways:
        page.add(row(name, train(options, kind, change, loss), first, second))


def train(
    options: argparse.Namespace, kind: type[MovingShape], change: Callable[[Grid, Grid], Between], loss: Loss
) -> Model:
    """Train the motion in one of the ways."""
    bar = TrainingBar(True)
    load = morph_loader([str(mesh) for mesh in options.meshes], surface_of, in_place=False, up=None, crease=30.0)
    with (
        patch.object(motion, "MovingShape", kind),
        patch.object(shapes_motion, "between", change),
        patch.object(level, "level_loss", loss),
        patch.object(sampling, "timed", timed_at_ends if kind is Ends else sampling.timed),
    ):
        shape, _ = load(bar)
        settings = training_settings(options.levels, options.steps)
        return Training(shape, settings, bar).run()


def surface_of(_: Model) -> ModelSurface:
    """Refuse a model: the ends are meshes here."""
    raise UserError("meshes are needed")


def row(name: str, model: Model, first: Path, second: Path) -> str:
    """Measure a motion."""
    apart: list[float] = []
    pieces: list[int] = []
    before: cKDTree | None = None
    for k in range(FRAMES + 1):
        try:
            mesh = extract_model(model, RESOLUTION, cull=True, time=k / FRAMES).mesh
        except UserError:  # no surface
            pieces.append(0)
            before = None
            continue
        tree = cKDTree(mesh.vertices)
        pieces.append(mesh.components()[0])
        if before is not None:
            there, back = tree.query(before.data)[0], before.query(mesh.vertices)[0]
            apart.append(float(max(np.max(there), np.max(back))))
        before = tree
    middle = float(np.median(apart))
    ends = " and ".join(f"{1e6 * error(model, mesh, time)[0]:.1f}" for mesh, time in ((first, 0.0), (second, 1.0)))
    return (
        f"| {name} | {middle:.4f} | {max(apart) / middle:.1f} | {pieces.count(0)} "
        f"| {sum(count > 1 for count in pieces)} | {max(pieces)} | {ends} | {share_of_band(model):.1%} |"
    )


def share_of_band(model: Model) -> float:
    """Return the share of the band in which |grad f| is within 0.5 to 1.5; NaN where a time has no surface."""
    try:
        return slopes(model)[3]
    except UserError:
        return float("nan")


if __name__ == "__main__":
    main()
