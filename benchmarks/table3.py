"""Marching cubes with and without culling (the paper's Table 3), and how its cost grows; writes docs/results/table3.md.

    python benchmarks/table3.py armadillo.safetensors lucy.safetensors dragon.safetensors
        [--resolution 512] [-o FILE]

Three ways are timed, from a model to a mesh in memory, in one process. SIREN: one network of (256, 4) is evaluated at
every vertex of the grid; its weights are random, since the time does not depend on them. Dense: all levels of the model
are evaluated at every vertex. Culled: as `mplicits mesh`. Dense runs take minutes and are done once, the SIREN's at
half the resolution.
"""

import argparse
import itertools
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mplicits.mesher.bar import Bar
from mplicits.mesher.extract import extract
from mplicits.mesher.grid import Grid
from mplicits.mesher.model_field import ModelField
from mplicits.mesher.surface import Mesh
from mplicits.model.model import Layer, Level, Model, shape_of
from mplicits.model.model_file import load
from protocol import Page, machine

WIDTH, DEPTH, OMEGA = 256, 4, 30.0
"""Of the SIREN."""
ROUNDS = 5
"""How many culled runs the first table's medians are of."""
SIZES = (128, 256, 512, 1024)
"""Resolutions of the second table."""
PRINTED = (
    "The paper's three columns (RTX 5090, other networks; culling skips the finer levels only): Armadillo 4.87, 4.10 "
    "and 0.99 s; Lucy 4.87, 7.49 and 1.07; dragon 4.88, 7.28 and 1.71."
)

ALONE = """
import resource, sys, time
from pathlib import Path
from mplicits.model.model_file import load
from mplicits.mesher.extract import extract
from mplicits.mesher.model_field import ModelField
from mplicits.mesher.grid import Grid
model, resolution = load(Path(sys.argv[1])), int(sys.argv[2])
began = time.perf_counter()
extract(ModelField(model, Grid(resolution).diagonal), resolution)
print(time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
"""
"""The program that `alone` runs. It prints seconds and GiB."""


def siren() -> Model:
    """Make the baseline: one SIREN of (256, 4) with random weights, which has no surface."""
    rng = np.random.default_rng(0)
    sizes = [3, *[WIDTH] * (DEPTH + 1), 1]
    layers = []
    for j, (columns, rows) in enumerate(itertools.pairwise(sizes)):
        bound = OMEGA / columns if j == 0 else math.sqrt(6 / columns)
        layers.append(Layer(rng.uniform(-bound, bound, (rows, columns)).astype(np.float32), np.zeros(rows, np.float32)))
    layers[-1] = replace(layers[-1], bias=np.array([10.0], np.float32))
    return Model("SIREN", (Level(tuple(layers), 1.0, 20),))


def seconds(model: Model, resolution: int, cull: bool) -> tuple[float, Mesh]:
    """Time the extraction of a mesh without normals and colors: return seconds and the mesh."""
    bar = Bar(quiet=False)
    began = time.perf_counter()
    mesh = extract(ModelField(model, Grid(resolution).diagonal if cull else math.inf), resolution, bar, cull)
    taken = time.perf_counter() - began
    bar.end()
    return taken, mesh


def alone(path: Path, resolution: int) -> tuple[float, float]:
    """Return the seconds and the GiB of memory of one culled extraction in a process of its own, without PyTorch."""
    command = [sys.executable, "-c", ALONE, str(path), str(resolution)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    taken, memory = done.stdout.split()
    return float(taken), float(memory)


def growth(paths: Sequence[Path], page: Page) -> None:
    """Write the second table: how time and memory of culled extraction grow with the resolution."""
    page.add(
        "",
        "## Growth",
        "",
        "Culled, medians of 3, each in a process of its own; the exponent of time in the resolution is by least "
        "squares. Memory: the process's peak, Python and its libraries included.",
        "",
        f"| model | {' | '.join(f'{size}^3, s' for size in SIZES)} | exponent | memory at {SIZES[-1]}^3, GiB |",
        "| --- |" + " ---: |" * (len(SIZES) + 2),
    )
    for path in paths:
        runs = [[alone(path, size) for _ in range(3)] for size in SIZES]
        taken = [statistics.median(first for first, _ in size_runs) for size_runs in runs]
        exponent = np.polyfit(np.log(SIZES), np.log(taken), 1)[0]
        figures = " | ".join(f"{median:.2f}" for median in taken)
        page.add(f"| {path.stem} | {figures} | {exponent:.2f} | {max(memory for _, memory in runs[-1]):.2f} |")


def speed(paths: Sequence[Path], resolution: int, page: Page) -> None:
    """Write the first table: the three ways at one resolution."""
    page.add(
        "| model | levels | faces | SIREN (256, 4), dense, s | dense, s | culled, s | SIREN / culled "
        "| dense / culled |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    )
    slow = seconds(siren(), resolution // 2, cull=False)[0] * 8
    for path in paths:
        model = load(path)
        runs = [seconds(model, resolution, cull=True) for _ in range(ROUNDS)]
        culled = statistics.median(taken for taken, _ in runs)
        dense, _ = seconds(model, resolution, cull=False)
        levels = ", ".join(shape_of(level.network) for level in model.levels)
        page.add(
            f"| {path.stem} | {levels} | {len(runs[0][1].faces):,} | {slow:.0f} | {dense:.1f} | {culled:.2f} "
            f"| {slow / culled:.0f} | {dense / culled:.1f} |"
        )


def main() -> None:
    """Write both tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", nargs="+", type=Path, metavar="M")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/table3.md"))
    options = parser.parse_args()
    size = options.resolution
    page = Page(
        options.output,
        f"# Table 3: marching cubes at {size}^3",
        "",
        f"Printed by `python benchmarks/table3.py {' '.join(path.name for path in options.models)}`. {machine()}.",
        "",
        f"Dense: all levels at every vertex, one run. Culled: `mplicits mesh`, medians of {ROUNDS}. The SIREN's time "
        f"is 8 times that at {size // 2}^3.",
        "",
        PRINTED,
        "",
    )
    speed(options.models, size, page)
    growth(options.models, page)


if __name__ == "__main__":
    main()
