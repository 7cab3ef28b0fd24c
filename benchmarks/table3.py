"""Marching cubes with and without culling (the paper's Table 3), and how its cost grows; writes docs/results/table3.md.

    PYTHONPATH=. python benchmarks/table3.py armadillo.safetensors lucy.safetensors dragon.safetensors
        [--resolution 512] [--no-baseline] [-o FILE]

SIREN: (256, 4) evaluated at every vertex of the grid; its weights are random, since time does not depend on them.
dense: all levels of the model at every vertex. culled: `mplicits mesh`. In one process, in turn; dense runs take
minutes and are run once, culled ones are medians of 5. Seconds are from a model to a mesh in memory.
"""

import argparse
import itertools
import math
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from codegen.model import Layer, Level, Model, load, shape_of
from mesher.bar import Bar
from mesher.extract import extract
from mesher.field import ModelField
from mesher.grid import Grid
from mesher.surface import Mesh

WIDTH, DEPTH, OMEGA = 256, 4, 30.0
ROUNDS = 5
SIZES = (128, 256, 512, 1024)
PRINTED = (
    "As the paper prints these three columns, on an RTX 5090 and with other networks: Armadillo 4.87, 4.10 and 0.99 s; "
    "Lucy 4.87, 7.49 and 1.07; dragon 4.88, 7.28 and 1.71. There, culling leaves out the finer levels alone."
)


def siren() -> Model:
    """The baseline: one SIREN of (256, 4) with random weights, and without a surface."""
    rng = np.random.default_rng(0)
    sizes = [3, *[WIDTH] * (DEPTH + 1), 1]
    layers = []
    for j, (columns, rows) in enumerate(itertools.pairwise(sizes)):
        bound = OMEGA / columns if j == 0 else math.sqrt(6 / columns)
        layers.append(Layer(rng.uniform(-bound, bound, (rows, columns)).astype(np.float32), np.zeros(rows, np.float32)))
    layers[-1] = replace(layers[-1], bias=np.array([10.0], np.float32))
    return Model("SIREN", (Level(tuple(layers), 1.0, 20),))


def seconds(model: Model, resolution: int, cull: bool) -> tuple[float, Mesh]:
    """What `mplicits mesh` spends before normals and colours, and its mesh."""
    bar = Bar(quiet=False)
    began = time.perf_counter()
    mesh = extract(ModelField(model, Grid(resolution).diagonal if cull else math.inf), resolution, bar, cull)
    taken = time.perf_counter() - began
    bar.end()
    return taken, mesh


def alone(path: Path, resolution: int) -> tuple[float, float]:
    """Seconds and GiB of memory of one culled extraction in a process of its own, which imports nothing else."""
    done = subprocess.run([sys.executable, __file__, str(path), "--alone", str(resolution)],
                          capture_output=True, text=True, check=True)
    taken, memory = done.stdout.split()
    return float(taken), float(memory)


def processor() -> str:
    """The processor's name, as far as the system tells."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "unknown processor")


def speed(paths: Sequence[Path], resolution: int, baseline: bool) -> list[str]:
    """The first table."""
    lines = ["| model | levels | faces | SIREN (256, 4), dense, s | dense, s | culled, s | SIREN / culled "
             "| dense / culled |", "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |"]
    slow = seconds(siren(), resolution, cull=False)[0] if baseline else math.nan
    for path in paths:
        model = load(path)
        dense, _ = seconds(model, resolution, cull=False)
        runs = [seconds(model, resolution, cull=True) for _ in range(ROUNDS)]
        culled = statistics.median(taken for taken, _ in runs)
        levels = ", ".join(shape_of(level.network) for level in model.levels)
        lines.append(f"| {path.stem} | {levels} | {len(runs[0][1].faces):,} | {slow:.1f} | {dense:.1f} | {culled:.2f} "
                     f"| {slow / culled:.0f} | {dense / culled:.1f} |")
    return lines


def growth(paths: Sequence[Path]) -> list[str]:
    """The second table."""
    lines = ["| model | " + " | ".join(f"{size}^3, s" for size in SIZES) + " | exponent | memory at "
             f"{SIZES[-1]}^3, GiB |", "| --- |" + " ---: |" * (len(SIZES) + 2)]
    for path in paths:
        found = [alone(path, size) for size in SIZES]
        taken = [statistics.median((first, *(alone(path, size)[0] for _ in range(2)))) for size, (first, _) in
                 zip(SIZES, found, strict=True)]
        exponent = np.polyfit(np.log(SIZES), np.log(taken), 1)[0]
        figures = " | ".join(f"{each:.2f}" for each in taken)
        lines.append(f"| {path.stem} | {figures} | {exponent:.2f} | {found[-1][1]:.2f} |")
    return lines


def main() -> None:
    """Writes both tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", nargs="+", type=Path, metavar="M")
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--no-baseline", action="store_true", help="leave out the SIREN, which takes minutes")
    parser.add_argument("--alone", type=int, help=argparse.SUPPRESS)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/table3.md"))
    options = parser.parse_args()
    if options.alone:
        model = load(options.models[0])
        began = time.perf_counter()
        extract(ModelField(model, Grid(options.alone).diagonal), options.alone)
        print(time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
        return
    text = [
        f"# Table 3: marching cubes at {options.resolution}^3", "",
        f"Printed by `PYTHONPATH=. python benchmarks/table3.py {' '.join(path.name for path in options.models)}`.", "",
        f"{processor()}, {os.cpu_count()} cores, NumPy {np.__version__}, {datetime.now(UTC):%Y-%m-%d}; "
        f"culled: medians of {ROUNDS}.", "", *speed(options.models, options.resolution, not options.no_baseline), "",
        PRINTED, "", "## Growth", "",
        "Culled, medians of 3 in processes of their own; the exponent of time in the resolution by least squares.", "",
        *growth(options.models), "",
    ]
    options.output.write_text("\n".join(text), encoding="utf-8")
    print("\n".join(text))


if __name__ == "__main__":
    main()
