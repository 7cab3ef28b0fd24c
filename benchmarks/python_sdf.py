"""Times `m.sdf` at a million points against plain PyTorch with the same weights: writes docs/results/python_sdf.md.

    python benchmarks/python_sdf.py [--model M] [--points N] [--rounds R] [-o FILE]

Plain PyTorch evaluates every network at every point: at all points at once, in chunks that fit the cache, and compiled
by torch.compile in such chunks. All have the same threads, run in turn, and the median of the rounds counts.
"""

import argparse
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

import mplicits
from protocol import Page, machine

CHUNKS = (2048, 8192, 65_536)
"""Points that plain PyTorch evaluates at a time."""
Run = Callable[[], object]


def plain(field: mplicits.Field) -> Callable[[Tensor], Tensor]:
    """Return the sum of all networks of a model as a function of points (N, 3), in PyTorch."""
    networks = [
        [(torch.tensor(layer.weight), torch.tensor(layer.bias)) for layer in level.network]
        for level in field.model.levels
    ]

    def evaluate(points: Tensor) -> Tensor:
        total = torch.zeros(len(points))
        for *hidden, (last, bias) in networks:
            values = points
            for weight, offset in hidden:
                values = torch.addmm(offset, values, weight.t()).sin_()
            total = total + torch.addmm(bias, values, last.t())[:, 0]
        return total

    return evaluate


def contenders(field: mplicits.Field, points: np.ndarray) -> dict[str, Run]:
    """Return what is timed, by name; the first is ours."""
    tensor, evaluate = torch.from_numpy(points), plain(field)
    compiled = torch.compile(evaluate, dynamic=False)

    def chunked(function: Callable[[Tensor], Tensor], chunk: int) -> Run:
        def run() -> Tensor:
            with torch.no_grad():
                return torch.cat([function(part) for part in torch.split(tensor, chunk)])

        return run

    runs: dict[str, Run] = {"mplicits, `m.sdf`": lambda: field.sdf(points)}
    runs |= {f"PyTorch, {chunk:,} points at a time": chunked(evaluate, chunk) for chunk in CHUNKS}
    runs["PyTorch, all points at once"] = chunked(evaluate, len(points))
    runs[f"PyTorch, compiled, {CHUNKS[1]:,} points at a time"] = chunked(compiled, CHUNKS[1])
    return runs


def timed(run: Run) -> tuple[float, float]:
    """Run once. Returns seconds by the clock on the wall, and those of all threads of this process."""
    began, spent = time.perf_counter(), time.process_time()
    run()
    return time.perf_counter() - began, time.process_time() - spent


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--model", default="spot", help="a model file, or a name of the gallery (default spot)")
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/python_sdf.md"))
    options = parser.parse_args()
    field = mplicits.load(options.model)
    points = np.random.default_rng(0).uniform(-1, 1, (options.points, 3)).astype(np.float32)
    torch.set_num_threads(len(os.sched_getaffinity(0)))
    runs = contenders(field, points)
    for name, run in list(runs.items()):
        try:
            run()
        except Exception as error:  # torch.compile raises anything where there is no compiler for it
            print(f"{name}: left out ({type(error).__name__})")
            del runs[name]
    measured: dict[str, list[tuple[float, float]]] = {name: [] for name in runs}
    for _ in range(options.rounds):
        for name, run in runs.items():
            measured[name].append(timed(run))
    (_, ours), *_ = measured.items()
    near = float(np.mean(np.abs(field(points, 1)) < field.model.levels[0].delta)) if len(field.levels) > 1 else 1.0
    page = Page(
        options.output,
        "# A million points from Python",
        "",
        f"Printed by `python benchmarks/python_sdf.py`: {len(points):,} points uniform in [-1, 1]^3, the networks "
        f"{' > '.join(field.levels)} of `{field.name}`; {near:.1%} of the points lie in level 1's band. Plain PyTorch "
        f"evaluates every network everywhere. {torch.get_num_threads()} threads each, in turn, median of "
        f"{options.rounds} rounds: how many times as long as `m.sdf`, by the clock on the wall and by the seconds that "
        "the processors spent.",
        "",
        f"{machine()}.",
        "",
        "| | clock | processors |",
        "| --- | ---: | ---: |",
    )
    for name, times in measured.items():
        wall, spent = (
            statistics.median(theirs[k] / mine[k] for theirs, mine in zip(times, ours, strict=True)) for k in (0, 1)
        )
        page.add(f"| {name} | {wall:.2f} | {spent:.2f} |")


if __name__ == "__main__":
    main()
