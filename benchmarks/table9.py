"""Measure the time of normals, computed in three ways (Table 9); writes docs/results/table9.md.

    python benchmarks/table9.py [--nets 256x2,256x3] [--side 512] [--rounds 3] [--device cuda] [-o FILE]

Each way evaluates value and gradient of one network with random weights, omega_0 = 30, at side x side points.
autograd: torch.autograd.grad, called as in the authors' renderer. Algorithm 1: the paper's Appendix E, one forward pass
with three tangents that share the values. adjoint: `value_and_gradient` of trainer/networks/network.py. They take turns
in one process, after each of them was compared with autograd in double precision.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from mplicits.trainer.openmp import prepare_openmp

if __name__ == "__main__":
    prepare_openmp()

import torch
from threadpoolctl import threadpool_limits
from torch import Tensor
from torch.nn import functional

from mplicits.model.files import write_whole
from mplicits.trainer import machine
from mplicits.trainer.networks import network
from mplicits.trainer.networks.network import Weights
from protocol import machine as described

Contender = Callable[[Tensor], tuple[Tensor, Tensor]]
"""Points (N, 3) -> value (N,), gradient (N, 3)."""

OMEGA = 30.0
CHUNKS = {"cpu": (512, 1024, 2048, 4096), "cuda": (16384, 65536)}
"""Points of a chunk that plans try."""
TRIAL = {"cpu": 65536, "cuda": 262144}
"""Points at which plans are tried and results are compared."""
TOLERANCE = 1e-5
"""Largest error of a contender, relative to the largest value or gradient."""
REST = 0.05
"""Seconds of rest, after which the last contender's threads no longer wait for work."""
COLUMNS = ("autograd", "Algorithm 1", "adjoint")
PAGES = Path(__file__).parents[1] / "docs" / "results"
SETTINGS = """
- as they come: all points in one call, PyTorch's own precision and threads.
- each at its best: the precision that `mplicits train` sets (here "{precision}"), and for each contender the fastest of
  {plans} plans: chunks of points, in one thread per core or one after the other on all cores.
- Ratios are medians over rounds. The paper prints, on its GPU, 1.6 to 2.3 for autograd over Algorithm 1.
"""


@dataclass(frozen=True)
class Plan:
    """How the points are divided among threads."""

    chunk: int
    """Points of a chunk."""
    workers: int
    """Chunks at a time; if several, each is on one thread."""
    precision: str
    """PyTorch's precision of products."""


def by_autograd(weights: Weights, points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate as the authors' renderer does, but with omega_0 in the weights, and no graph for them."""
    at = points.detach().requires_grad_()
    hidden = at
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        hidden = functional.linear(hidden, weight, bias).sin()
    f = functional.linear(hidden, weights[-2], weights[-1])
    (gradient,) = torch.autograd.grad(f, at, torch.ones_like(f))
    return f.detach()[:, 0], gradient


@torch.no_grad()
def algorithm_1(weights: Weights, points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate by the paper's Algorithm 1: one forward pass with three tangents, four matrix products a layer.

    The tangents share the values, which the paper's listing computes again for each coordinate.
    """
    angle = torch.addmm(weights[1], points, weights[0].t())
    cosine = network.cos(angle)
    hidden = network.sin_(angle)
    tangents = [cosine * column for column in weights[0].t()]
    for weight, bias in zip(weights[2:-2:2], weights[3:-2:2], strict=True):
        angle = torch.addmm(bias, hidden, weight.t())
        cosine = network.cos(angle)
        hidden = network.sin_(angle)
        tangents = [(tangent @ weight.t()).mul_(cosine) for tangent in tangents]
    row = weights[-2][0]
    return torch.addmv(weights[-1], hidden, row), torch.stack([tangent @ row for tangent in tangents], dim=1)


class Bench:
    """The points that contenders are measured at, and the threads that they run on."""

    def __init__(self, side: int, device: torch.device) -> None:
        """side: the square root of the number of points."""
        self.points = (torch.rand(side * side, 3, generator=torch.Generator().manual_seed(1)) * 2 - 1).to(device)
        self.kind, self.threads = device.type, torch.get_num_threads()
        self.precision = torch.get_float32_matmul_precision()
        self._pool = ThreadPoolExecutor(self.threads, initializer=torch.set_num_threads, initargs=(1,))
        at_once = Plan(len(self.points), 1, self.precision)
        workers = {1, self.threads if self.kind == "cpu" else 1}
        self.plans = [
            at_once,
            *(Plan(chunk, count, self.precision) for chunk in CHUNKS[self.kind] for count in workers),
        ]

    def run(self, contender: Contender, plan: Plan, count: int | None = None) -> tuple[Tensor, Tensor, float]:
        """Evaluate at the first `count` points. Returns the value, the gradient, and the seconds that it took."""
        threads = self.threads if plan.workers == 1 else 1
        torch.set_float32_matmul_precision(plan.precision)
        torch.set_num_threads(threads)
        with threadpool_limits(threads, "blas"):
            time.sleep(REST)
            began = time.perf_counter()
            parts = torch.split(self.points[:count], plan.chunk)
            results = list((map if plan.workers == 1 else self._pool.map)(contender, parts))
            f, gradient = (torch.cat(column) for column in zip(*results, strict=True))
            if self.kind == "cuda":
                torch.cuda.synchronize()
            return f, gradient, time.perf_counter() - began

    def best(self, contender: Contender) -> Plan:
        """Find the plan whose better run of two is the fastest; one more run before is not timed."""
        self.run(contender, self.plans[0], TRIAL[self.kind])
        seconds = [min(self.run(contender, plan, TRIAL[self.kind])[2] for _ in range(2)) for plan in self.plans]
        return self.plans[seconds.index(min(seconds))]

    def errors(self, weights: Weights, contenders: Sequence[tuple[Contender, Plan]]) -> list[float]:
        """Measure each contender's largest difference from autograd in double precision.

        Of value or gradient, relative to the largest.
        """
        count = TRIAL[self.kind]
        exact = by_autograd([weight.double() for weight in weights], self.points[:count].double())
        results = (self.run(contender, plan, count)[:2] for contender, plan in contenders)
        return [
            max(float((a - b).abs().max() / b.abs().max()) for a, b in zip(result, exact, strict=True))
            for result in results
        ]

    def turns(self, contenders: Sequence[tuple[Contender, Plan]], rounds: int) -> list[list[float]]:
        """Let the contenders take turns. Returns the seconds of each one in each round."""
        times = [[self.run(contender, plan)[2] for contender, plan in contenders] for _ in range(rounds + 1)]
        return [list(column) for column in zip(*times[1:], strict=True)]


def table(bench: Bench, size: tuple[int, int], rounds: int) -> tuple[list[str], list[str]]:
    """Measure one network of size (width, depth). Returns its lines of the table, and the remarks on it."""
    net = f"{size[0]}x{size[1]}"
    generator = torch.Generator().manual_seed(0)
    weights = [weight.to(bench.points.device) for weight in network.initial(size, OMEGA, 1, generator)]
    ways = (by_autograd, algorithm_1, network.value_and_gradient)
    ours: dict[str, Contender] = {name: partial(way, weights) for name, way in zip(COLUMNS, ways, strict=True)}
    first = Plan(len(bench.points), 1, "highest")
    groups = {"as they come": {name: (way, first) for name, way in ours.items()}}
    groups["each at its best"] = {name: (way, bench.best(way)) for name, way in ours.items()}
    keys = [(settings, name) for settings, group in groups.items() for name in group]
    running = [groups[settings][name] for settings, name in keys]
    worst = max(bench.errors(weights, running))
    if worst > TOLERANCE:
        raise SystemExit(f"{net}: a contender is off by {worst:.1e} of the largest value")
    times = bench.turns(running, rounds)
    seconds = dict(zip(keys, times, strict=True))

    def line(settings: str, cells: dict[str, list[float]]) -> str:
        medians = [f"{statistics.median(cells[name]):.3f}" for name in COLUMNS]
        ratios = [
            f"{statistics.median(a / b for a, b in zip(cells[name], cells['adjoint'], strict=True)):.2f}"
            for name in COLUMNS[:2]
        ]
        return f"| {' | '.join([net, settings, *medians, *ratios])} |"

    mixed = {name: seconds["as they come", name] for name in COLUMNS[:2]}
    mixed["adjoint"] = seconds["each at its best", "adjoint"]
    lines = [line(settings, {name: seconds[settings, name] for name in group}) for settings, group in groups.items()]
    lines.insert(2, line("the adjoint at its best, the others as they come", mixed))
    return lines, [
        f"- {net}: largest difference from double precision, relative to the largest value or gradient: {worst:.1e}.",
    ]


def main() -> None:
    """Measure the networks, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--nets", default="256x2,256x3", help="width x hidden layers, separated by commas")
    parser.add_argument("--side", type=int, default=512)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("-o", "--output", type=Path, help="default: docs/results/table9.md, or table9_cuda.md")
    options = parser.parse_args()
    output = options.output or PAGES / ("table9.md" if options.device == "cpu" else "table9_cuda.md")
    device = torch.device(options.device)
    machine.prepare(device)
    bench = Bench(options.side, device)
    on = "" if device.type == "cpu" else f"{torch.cuda.get_device_name()}; "
    remarks = [SETTINGS.format(precision=bench.precision, plans=len(bench.plans))]
    lines = [
        "# Normals: autograd, the paper's Algorithm 1, the adjoint (Table 9)",
        "",
        "Printed by `python benchmarks/table9.py`.",
        "",
        f"{on}{described()}; {options.side} x {options.side} points, medians of {options.rounds} rounds in turn",
        "",
        f"| net | settings | {' | '.join(f'{name}, s' for name in COLUMNS)} | autograd / adjoint "
        "| Algorithm 1 / adjoint |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for net in options.nets.split(","):
        width, depth = map(int, net.split("x"))
        rows, remark = table(bench, (width, depth), options.rounds)
        print(*rows, *remark, sep="\n", flush=True)
        lines += rows
        remarks += remark
        write_whole(output, "\n".join([*lines, *remarks]) + "\n")  # what is measured outlives a time limit


if __name__ == "__main__":
    main()
