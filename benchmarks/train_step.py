"""One training step of a residual, three ways, in turn in one process; prints a markdown table.

    python benchmarks/train_step.py [--points 8192] [--rounds 30]

ours: `trainer.level`: hand-written adjoint, earlier levels from the pool, a part of the batch on each core.
autograd: the same step with the gradient by torch.autograd.grad(create_graph=True).
authors' way: no pool: the earlier levels are evaluated, and differentiated by autograd, again at every step, and the
loss runs back through everything, as the paper's released training loop does; PyTorch's own threads and precision.
"""

import argparse
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from unittest.mock import patch

import torch
from torch import Tensor

from trainer import level, losses, machine, pools
from trainer.network import Weights, initial, value
from trainer.optimiser import Optimiser
from trainer.settings import RESIDUAL
from trainer.workers import Workers, cores

CASES = (((64, 1),), (64, 2)), (((64, 2),), (128, 2)), (((64, 2), (128, 2)), (256, 2))
"""Sizes of the earlier levels, and of the residual that is trained."""
REST = 0.05
"""Seconds in which the threads of the step before stop waiting for more."""
CPU = torch.device("cpu")


def by_autograd(weights: Weights, points: Tensor) -> tuple[Tensor, Tensor]:
    """`trainer.network.value_and_gradient`, by autograd."""
    at = points.detach().requires_grad_()
    f = value(weights, at)[:, 0]
    return f, torch.autograd.grad(f.sum(), at, create_graph=True)[0]


def make_pool(points: Tensor, frozen: Sequence[Weights], on_surface: bool) -> pools.Pool:
    normals = torch.nn.functional.normalize(points, dim=1) if on_surface else None
    return pools.Pool(points, torch.zeros(len(points)), normals, *pools.evaluate(frozen, points))


def our_step(weights: Weights, surface: pools.Pool, volume: pools.Pool) -> Callable[[], None]:
    generator = torch.Generator().manual_seed(0)
    step = level.step(surface, volume, RESIDUAL, generator, Workers(CPU))
    optimiser = Optimiser(weights, 1e-4, 0.1)

    def run() -> None:
        step(weights)
        optimiser.step(1)

    return run


def autograd_step(weights: Weights, surface: pools.Pool, volume: pools.Pool) -> Callable[[], None]:
    ours = our_step(weights, surface, volume)

    def run() -> None:
        with patch("trainer.level.value_and_gradient", by_autograd):
            ours()

    return run


def authors_step(
    weights: Weights, earlier: Sequence[Weights], surface: pools.Pool, volume: pools.Pool
) -> Callable[[], None]:
    optimiser = torch.optim.Adam(weights, 1e-4)
    earlier = [[w.clone().requires_grad_() for w in each] for each in earlier]
    half, weight = level.BATCH // 2, RESIDUAL

    def run() -> None:
        on, around = (torch.randint(len(pool.points), (half,)) for pool in (surface, volume))
        points = torch.cat((surface.points[on], volume.points[around]))
        f, gradient = by_autograd(weights, points)
        for each in earlier:
            part = by_autograd(each, points)
            f, gradient = f + part[0], gradient + part[1].detach()
        assert surface.normals is not None
        loss = (
            weight.value * losses.value(f[:half], torch.zeros(half))
            + weight.normal * losses.normal(gradient[:half], surface.normals[on])
            + weight.distance * losses.value(f[half:], torch.zeros(half))
            + weight.eikonal * losses.eikonal(gradient)
        )
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()

    return run


def our_settings() -> None:
    """What `mplicits train` sets."""
    machine.prepare(CPU)


def default_settings() -> None:
    """PyTorch as it comes."""
    torch.set_num_threads(cores())
    torch.set_float32_matmul_precision("highest")


def medians(steps: Sequence[tuple[Callable[[], None], Callable[[], None]]], rounds: int) -> list[float]:
    """Median seconds of each step, the steps taking turns. Before each, untimed, its settings and a rest."""
    times: list[list[float]] = [[] for _ in steps]
    for done in range(rounds + 3):
        for (prepare, step), kept in zip(steps, times, strict=True):
            prepare()
            time.sleep(REST)
            began = time.perf_counter()
            step()
            if done >= 3:
                kept.append(time.perf_counter() - began)
    return [statistics.median(kept) for kept in times]


def processor() -> str:
    """The processor's name, as far as the system tells."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=int, default=8192, help="samples of a step")
    parser.add_argument("--rounds", type=int, default=30)
    options = parser.parse_args()
    level.BATCH = options.points
    our_settings()
    print(f"{processor()}, {cores()} cores, torch {torch.__version__}, {datetime.now(UTC):%Y-%m-%d}; "
          f"{options.points} points a step, medians of {options.rounds} steps in turn\n")
    print("| residual | after | ours, ms | autograd, ms | authors' way, ms | autograd / ours | authors' / ours |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    generator = torch.Generator().manual_seed(0)
    for sizes, size in CASES:
        earlier = [initial(each, 40.0, 1, generator) for each in sizes]
        points = torch.rand(65536, 3, generator=generator) * 2 - 1
        surface, volume = make_pool(points[:32768], earlier, True), make_pool(points[32768:], earlier, False)
        own = [[w.requires_grad_() for w in initial(size, 80.0, 1, generator)] for _ in range(3)]
        ours, autograd, authors = medians(
            (
                (our_settings, our_step(own[0], surface, volume)),
                (our_settings, autograd_step(own[1], surface, volume)),
                (default_settings, authors_step(own[2], earlier, surface, volume)),
            ),
            options.rounds,
        )
        names = [f"{width}x{depth}" for width, depth in (size, *sizes)]
        print(f"| {names[0]} | {' + '.join(names[1:])} | {ours * 1e3:.1f} | {autograd * 1e3:.1f} | {authors * 1e3:.1f} "
              f"| {autograd / ours:.2f} | {authors / ours:.2f} |", flush=True)


if __name__ == "__main__":
    main()
