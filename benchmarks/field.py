"""Measures the errors of trained fields, and their loose components: writes docs/results/field.md.

    python benchmarks/field.py [FILE...] [--levels 64x1,64x2] [--seconds 60 | --steps 1000,2200] [--seeds 0,1,2]
        [--keep FOLDER] [-o docs/results/field.md]

FILE: meshes; default: meshes/ and thingi32/ in the data folder. Steps, unlike seconds, do not depend on the machine's
load.
"""

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contenders import trained, training_settings
from mplicits.field.interpret import nested_field
from mplicits.ir.lower import lower
from mplicits.mesher.compare import Figures, compare
from mplicits.mesher.distance import compare_field
from mplicits.mesher.extract import extract, extract_model
from mplicits.mesher.surface import Array
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.model.field_figures import EXCESS_FACTOR, EXCESS_OFFSET
from mplicits.model.model import Model
from mplicits.model.model_file import save
from mplicits.trainer import sampling
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from protocol import DATA, Page, machine

BALL_POINTS = 1_000_000
"""Points of the unit ball at which f is compared with the distance."""
GRADIENT_POINTS = 100_000
"""Points of the surface at which |grad f| is measured."""
OVER = 1.3
"""|f| should be at most this multiple of the distance, plus EXCESS_OFFSET."""


class ExactField:
    """The exact signed distance to a shape as a field for marching cubes."""

    chunk = 8192

    def __init__(self, shape: Shape) -> None:
        """shape: in model space."""
        self._shape = shape

    def value(self, points: Array) -> Array:
        """Return the distances (N,) of points (N, 3)."""
        return self._shape.distance(points.astype(np.float64)).astype(np.float32)

    def clearance(self, points: Array) -> Array:
        """Return the distances (N,) from points (N, 3) to the surface."""
        return np.abs(self.value(points))


@dataclass(frozen=True)
class InBall:
    """Errors of a field in the unit ball."""

    error: float
    """Mean |f - d|."""
    excess: float
    """Share of the points where f is too large, by `field_figures`."""
    over: int
    """Points where |f| > OVER |d| + EXCESS_OFFSET."""
    over_outside: int
    """Of these points, the ones farther from the surface than delta_1."""
    ratio: float
    """The largest |f| / |d| farther from the surface than delta_1."""


def in_ball(model: Model, shape: Shape) -> InBall:
    """Compare a model's field with the distance to its shape at `BALL_POINTS` points."""
    points = sampling.ball(BALL_POINTS, 1.0, np.random.default_rng(0))
    distance = shape.distance(points)
    program, parts = lower(model), np.array_split(points.astype(np.float32), BALL_POINTS // 50_000)
    f = np.concatenate([nested_field(program, part, len(model.levels))[0] for part in parts]).astype(np.float64)
    size, truth = np.abs(f), np.abs(distance)
    outside, over = truth > model.levels[0].delta, size > OVER * truth + EXCESS_OFFSET
    return InBall(
        error=float(np.abs(f - distance).mean()),
        excess=float((size > EXCESS_FACTOR * truth + EXCESS_OFFSET).mean()),
        over=int(over.sum()),
        over_outside=int((over & outside).sum()),
        ratio=float((size / truth)[outside].max()),
    )


def exact(path: Path, options: argparse.Namespace) -> Figures:
    """Compare the mesh of exact distances with the truth: the best that any field can reach on this grid."""
    shape, _ = load_shape(str(path))
    return compare(
        extract(ExactField(shape), options.resolution), in_model_space(read_mesh(path), shape.center, shape.scale)
    )


def row(path: Path, seed: int, of_exact: Figures, options: argparse.Namespace) -> str:
    """Train a shape and return its row of the table."""
    began = time.perf_counter()
    shape, _ = load_shape(str(path))
    chosen = training_settings(options.levels, options.steps, None if options.steps else options.seconds, seed)
    model = trained(shape, chosen, began)
    if options.keep:
        save(model, options.keep / f"{path.stem}-{seed}.safetensors")
    truth = in_model_space(read_mesh(path), *model.place)
    field, ball = compare_field(model, truth, GRADIENT_POINTS), in_ball(model, shape)
    figures = compare(extract_model(model, options.resolution).mesh, truth)
    last = model.provenance["levels"][-1]
    low, middle, high = field.gradient
    return (
        f"| {path.stem} | {seed} | {last['mean_f']:.2e} | {last['angle']:.1f} | {ball.error:.1e} | {ball.excess:.2%} "
        f"| {ball.over} ({ball.over_outside}) | {ball.ratio:.2f} "
        f"| {low:.2f}, {middle:.2f}, {high:.2f} "
        f"| {figures.chamfer / figures.floor:.2f} | {figures.hausdorff:.1e} ({of_exact.hausdorff:.1e}) "
        f"| {figures.components} ({of_exact.components}) | {figures.truth_components} |"
    )


def main() -> None:
    """Train and measure every shape with every seed."""
    parser = argparse.ArgumentParser(description="the field as a distance, and loose components")
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument("--levels", default="64x1,64x2", metavar="NxD,..")
    parser.add_argument("--seconds", type=float, default=60.0, metavar="S")
    parser.add_argument("--steps", metavar="N,..", help="in place of seconds")
    parser.add_argument("--seeds", default="0,1,2", metavar="K,..")
    parser.add_argument("--resolution", type=int, default=512, metavar="N", help="of marching cubes (default 512)")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder to save the models in")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/field.md"))
    options = parser.parse_args()
    default = [*sorted((DATA / "meshes").glob("*.ply")), *sorted((DATA / "thingi32").glob("*.ply"))]
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    length = f"--steps {options.steps}" if options.steps else f"--seconds {options.seconds:g}"
    prepare(device("cpu"))
    page = Page(
        options.output,
        "# The field as a distance",
        "",
        f"Printed by `python benchmarks/field.py --levels {options.levels} {length} --seeds {options.seeds}`. "
        f"{machine()}.",
        "",
        f"- Mean error: of the nested field f at {BALL_POINTS:,} points of the unit ball, against the exact signed "
        "distance d.",
        f"- Too large: |f| > {EXCESS_FACTOR} |d| + {EXCESS_OFFSET}. Over: points with |f| > {OVER} |d| + "
        f"{EXCESS_OFFSET}; in brackets, those farther away than delta_1. Largest ratio: of |f| to |d| farther "
        "away than delta_1.",
        "- Gradient: 10th, 50th, 90th percentile of |grad f| on the surface.",
        f"- Chamfer, Hausdorff, components: marching cubes at {options.resolution}^3, 500,000 samples on each side. In "
        "brackets: the same of the exact distances.",
        "",
        "| shape | seed | mean abs f | angle, degrees | mean error | too large at | over | largest ratio | gradient "
        "| Chamfer, of the floor | Hausdorff | components | of the truth |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---|---:|---:|---:|---:|",
    )
    for path in options.files or default:
        of_exact = exact(path, options)
        for seed in map(int, options.seeds.split(",")):
            page.add(row(path, seed, of_exact, options))


if __name__ == "__main__":
    main()
