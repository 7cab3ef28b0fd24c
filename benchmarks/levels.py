"""Compare numbers of levels at equal parameters and equal seconds of the processor; writes docs/results/levels.md.

    python benchmarks/levels.py [FILE...] [--seconds 40] [--ways "NAME;.."] [--rows N] [-o docs/results/levels.md]

FILE: meshes; by default five of the data's folder. The ways: one level; two of one width; two, the last of which is
wide; three; and these three networks without nesting: their sum f1 + r1 + r2, each trained by the same loss and
schedule as a level, but in the whole domain, and evaluated everywhere. Rows that the page has already are kept, those
of other lengths too, so that a run that was cut short goes on; --rows says how many more to measure.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
import torch

from contenders import EVERYWHERE, one_siren, ours, training_settings
from mplicits.mesher.evaluate import compare
from mplicits.mesher.extract import extract_model
from mplicits.mesher.truth import in_model_space, read_mesh
from mplicits.model.errors import UserError
from mplicits.model.model import DEFAULT_ITERATIONS, Level, Model
from mplicits.trainer import level, plan, quality
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.networks.fit import Task, fit
from mplicits.trainer.networks.nested import field_and_gradient
from mplicits.trainer.networks.network import Weights, to_model
from mplicits.trainer.pools import Pool, Sampler
from mplicits.trainer.session import TrainingBar
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from protocol import DATA, Page, machine

SHAPES = ("meshes/armadillo", "meshes/lucy", "meshes/happy_buddha", "thingi32/53159", "thingi32/64764")
CPU = torch.device("cpu")
THREE = "64x1,64x2,64x2"
"""The sizes whose number of parameters no way exceeds."""
WIDE_LAST = "48x1,96x2"
RESOLUTION = 256
"""Of marching cubes."""
SAMPLES = 200_000
"""Of each surface that is compared."""


@dataclass(frozen=True)
class Way:
    """One way to spend the parameters."""

    sizes: str
    """As --levels takes them."""
    train: Callable[[Shape, float, int], tuple[Model, tuple[int, ...]]]
    """(shape, seconds, seed) -> the model, and the optimiser steps of its networks."""


def count(sizes: str) -> int:
    """Count the parameters of networks, as --levels takes them."""
    pairs = [tuple(map(int, part.split("x"))) for part in sizes.split(",")]
    return sum(4 * n + d * n * (n + 1) + n + 1 for n, d in pairs)


def two_levels(most: int) -> str:
    """Choose the widest two levels, Wx1 and Wx2, of at most so many parameters."""
    return max((f"{n}x1,{n}x2" for n in range(8, 512) if count(f"{n}x1,{n}x2") <= most), key=count)


def single(shape: Shape, seconds: float, seed: int) -> tuple[Model, tuple[int, ...]]:
    """Train one network of as many parameters."""
    return _with_steps(one_siren(shape, count(THREE), seconds, seed))


def nested(sizes: str, shape: Shape, seconds: float, seed: int) -> tuple[Model, tuple[int, ...]]:
    """Train levels of these sizes as `mplicits train` does."""
    return _with_steps(ours(shape, sizes, seconds, seed))


def unnested(shape: Shape, seconds: float, seed: int) -> tuple[Model, tuple[int, ...]]:
    """Train the networks of `THREE` one after another, each on level 1's samples with the networks before added."""
    began, settings = time.perf_counter(), training_settings(THREE, seconds=seconds, seed=seed)
    probe = quality.SurfaceProbe(shape, CPU)
    trained: list[Weights] = []
    levels: list[Level] = []
    steps: list[int] = []
    *budgets, _ = plan.budgets(settings, 0, 0.0, False, began, kept=0.0)
    for index, (network, omega, budget) in enumerate(zip(settings.networks, settings.omegas, budgets, strict=True)):
        first, own_seed = index == 0, seed * 1000 + index
        sampler = Sampler(shape, [], [], CPU, np.random.default_rng(own_seed))
        pools = [draw(plan.pool_size(budget)) for draw in (sampler.surface, sampler.volume)]
        surface, volume = (_added(pool, trained) for pool in pools)
        weight = settings.loss_weights(first=first)
        rate, output_factor = level.rates(network[0], None if first else probe.delta(trained))
        task = Task(
            start=level.start(network, omega, first=first, seed=own_seed, device=CPU),
            step=level.LevelStep(surface, volume, weight, torch.Generator().manual_seed(own_seed)),
            idle=level.idle_loss(surface, volume, weight),
            rate=rate,
            output_factor=output_factor,
        )
        outcome = fit(task, budget, TrainingBar(quiet=True))
        trained.append(outcome.weights)
        steps.append(outcome.steps)
        slope = quality.lipschitz(trained, torch.cat((surface.points, volume.points)))
        levels.append(Level(to_model(outcome.weights), EVERYWHERE, DEFAULT_ITERATIONS[min(index, 1)], slope))
    last = probe.measure(trained)[-1]
    record = {"mean_f": last.mean_f, "angle": last.angle}
    return Model(
        shape.name, tuple(levels), centre=shape.centre, scale=shape.scale, provenance={"levels": [record]}
    ), tuple(steps)


def _added(pool: Pool, trained: list[Weights]) -> Pool:
    """Add the networks that are trained already to a pool of level 1."""
    frozen, gradient = field_and_gradient(trained, pool.points)
    return Pool(pool.points, pool.distance, pool.normals, frozen, gradient)


def _with_steps(model: Model) -> tuple[Model, tuple[int, ...]]:
    return model, tuple(record["steps"] for record in model.provenance["levels"])


def ways() -> dict[str, Way]:
    """Return the ways to train, by their names in the table."""
    most = count(THREE)
    widest = max((f"{n}x2" for n in range(8, 512) if count(f"{n}x2") <= most), key=count)
    two = two_levels(most)
    return {
        "one level": Way(widest, single),
        "two": Way(two, partial(nested, two)),
        "two, wide last": Way(WIDE_LAST, partial(nested, WIDE_LAST)),
        "three": Way(THREE, partial(nested, THREE)),
        "unnested": Way(THREE, unnested),
    }


def row(path: Path, name: str, way: Way, options: argparse.Namespace) -> str:
    """Train a shape in one way and return its row of the table."""
    trained = columns(path, lambda shape: way.train(shape, options.seconds, options.seed))
    return f"{_start(path, name, options)}| {way.sizes} {trained}"


def _start(path: Path, name: str, options: argparse.Namespace) -> str:
    """Return the columns that tell a row from others."""
    return f"| {path.stem} | {name} | {options.seconds:g} s "


def columns(path: Path, train: Callable[[Shape], tuple[Model, tuple[int, ...]]]) -> str:
    """Train a shape and return the columns that both tables have: parameters, seconds, steps, and how near it came.

    train: makes the model, and the optimiser steps of its networks. Its seconds are those of the processor.
    """
    shape, _ = load_shape(str(path))
    began = time.process_time()
    with patch("time.perf_counter", time.process_time):  # whatever else the machine does, all ways get as much of it
        model, steps = train(shape)
    seconds, last = time.process_time() - began, model.provenance["levels"][-1]
    start = (
        f"| {model.parameters():,} | {seconds:.0f} "
        f"| {', '.join(map(str, steps))} | {last['mean_f']:.2e} | {last['angle']:.2f} |"
    )
    try:
        mesh = extract_model(model, RESOLUTION).mesh
    except UserError:
        return f"{start} no surface | | |"
    figures = compare(mesh, in_model_space(read_mesh(path), *model.place), SAMPLES)
    return (
        f"{start} {figures.chamfer / figures.floor:.2f} | {figures.hausdorff:.1e} "
        f"| {figures.components} ({figures.truth_components}) |"
    )


def main() -> None:
    """Measure the rows that the page lacks, and write it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument("--seconds", type=float, default=40.0, metavar="S")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--ways", default=";".join(ways()), metavar="NAME;..", help="default: %(default)s")
    parser.add_argument("--rows", type=int, metavar="N", help="measure so many rows at most (default: all)")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/levels.md"))
    options = parser.parse_args()
    prepare(device("cpu"))
    files = options.files or [DATA / f"{name}.ply" for name in SHAPES]
    lines = options.output.read_text(encoding="utf-8").splitlines() if options.output.exists() else []
    known = [line for line in lines if line.startswith("| ") and " s | " in line]
    page = Page(
        options.output,
        "# Numbers of levels",
        "",
        f"Printed by `python benchmarks/levels.py --seconds S`, once for each length given (--seed {options.seed}): "
        "one level, two of one width, two with a wide last one, three, and the three networks unnested (their sum, "
        "each trained with the loss and the schedule of a level, but in the whole domain, and evaluated everywhere), "
        f"with equal parameters, for equal seconds of the processor, {torch.get_num_threads()} thread(s), one seed. "
        "The seconds include measuring bands and bounds for tracing, and looking for loose pieces of surface, which "
        "the unnested networks do without: they take more steps. Mean abs f and angle are of held-out points of the "
        "surface; Chamfer distance (of its floor), Hausdorff distance and components at "
        f"{RESOLUTION}^3.",
        "",
        f"{machine()}.",
        "",
        "| shape | way | given | networks | parameters | seconds | steps | mean abs f | angle, degrees "
        "| Chamfer, of the floor | Hausdorff | components (truth) |",
        "| --- | --- | --- | --- | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: |",
        *known,
    )
    left = options.rows
    for path in files:
        for name in options.ways.split(";"):
            if any(line.startswith(_start(path, name, options)) for line in known):
                continue
            if left is None or left > 0:
                page.add(row(path, name, ways()[name], options))
                left = None if left is None else left - 1


if __name__ == "__main__":
    main()
