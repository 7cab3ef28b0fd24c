"""Measure one training step of a residual, done in three ways in turn; writes docs/results/train_step.md.

    python benchmarks/train_step.py [--points 8192] [--rounds 8] [--device cuda] [-o FILE]

ours: the step of `trainer.level`, with its hand-written adjoint and derivatives, the earlier levels taken from the
pool, and the settings of `mplicits train`.
autograd: the same step and settings, with the gradient by torch.autograd.grad(create_graph=True).
authors' way: without a pool. The earlier levels are evaluated and differentiated by autograd again at every step, and
the loss runs back through everything, as in the paper's released training loop. It runs twice: in our process with
PyTorch's own precision and number of threads, and in a process of its own where PyTorch and the C library are as they
come. The faster one counts.
"""

import argparse
import multiprocessing
import os
import statistics
import time
from collections.abc import Callable, Sequence
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path

from mplicits.trainer.openmp import prepare_openmp

if __name__ == "__main__":
    prepare_openmp()

import torch

os.environ.pop("GOMP_SPINCOUNT", None)  # the other process must not inherit it

from torch import Tensor
from torch.nn import functional

import protocol
from mplicits.trainer import machine
from mplicits.trainer.config import LossConfig
from mplicits.trainer.level import LevelStep
from mplicits.trainer.networks.muon import Muon
from mplicits.trainer.networks.nested import field_and_gradient
from mplicits.trainer.networks.network import Weights, initial, value
from mplicits.trainer.networks.optimizer import Optimizer
from mplicits.trainer.training_samples import Batches, Pool

CASES = (((64, 1),), (64, 2)), (((64, 2),), (128, 2)), (((64, 2), (128, 2)), (256, 2))
"""(width, depth) of the earlier levels, and of the residual that is trained."""
REST = 0.05
"""Seconds after which the threads of the step before no longer wait for more work."""
WARM, TIMED = 2, 4
"""Untimed and timed steps of a turn."""
THREADS = torch.get_num_threads()
"""PyTorch's own number of threads."""


def by_autograd(weights: Weights, points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate a network's value (N,) and gradient (N, 3) by autograd, with a graph of both."""
    at = points.detach().requires_grad_()
    f = value(weights, at)[:, 0]
    return f, torch.autograd.grad(f.sum(), at, create_graph=True)[0]


def make_pool(points: Tensor, frozen: Sequence[Weights], on_surface: bool) -> Pool:
    """Make a pool of `points` with distances of zero, and with normals where they are on the surface."""
    normals = functional.normalize(points, dim=1) if on_surface else None
    return Pool(points, torch.zeros_like(points[:, 0]), normals, *field_and_gradient(frozen, points))


class Case:
    """The networks and samples of one row of the table, which are the same in every process."""

    def __init__(self, index: int, device: torch.device, batch: int) -> None:
        self.batch = batch
        sizes, self.size = CASES[index]
        generator = torch.Generator().manual_seed(index)
        self.earlier = [[w.to(device) for w in initial(size, 40.0, 1, generator)] for size in sizes]
        points = (torch.rand(65536, 3, generator=generator) * 2 - 1).to(device)
        self.surface = make_pool(points[:32768], self.earlier, True)
        self.volume = make_pool(points[32768:], self.earlier, False)
        self.start = [w.to(device) for w in initial(self.size, 80.0, 1, generator)]

    def weights(self) -> Weights:
        """Copy the residual as it is at the start."""
        return [w.clone().requires_grad_() for w in self.start]

    def ours(self) -> Callable[[], None]:
        """Make a step of our trainer."""
        weights, generator = self.weights(), torch.Generator().manual_seed(0)
        step = LevelStep(self.surface, self.volume, LossConfig.residual, generator, batch=self.batch)
        optimizer = Muon(weights, 1e-4, 0.1)

        def run() -> None:
            step(weights)
            optimizer.step(1)

        return run

    def autograd(self) -> Callable[[], None]:
        """Make the same step with the gradient by autograd."""
        weights, half = self.weights(), self.batch // 2
        generator = torch.Generator().manual_seed(0)
        surface, volume = Batches(self.surface, half, generator), Batches(self.volume, half, generator)
        optimizer = Optimizer(weights, 1e-4, 0.1)

        def run() -> None:
            on, around = next(surface), next(volume)
            f, gradient = by_autograd(weights, torch.cat((on.points, around.points)))
            f = f + torch.cat((on.frozen, around.frozen))
            gradient = gradient + torch.cat((on.frozen_gradient, around.frozen_gradient))
            assert on.normals is not None
            loss(f, gradient, on.normals).backward()  # type: ignore[no-untyped-call]
            optimizer.step(1)

        return run

    def authors(self) -> Callable[[], None]:
        """Make a step the authors' way."""
        weights, half = self.weights(), self.batch // 2
        optimizer = torch.optim.Adam(weights, 1e-4)
        earlier = [[w.clone().requires_grad_() for w in network] for network in self.earlier]

        def run() -> None:
            on, around = (
                torch.randint(len(pool.points), (half,), device=pool.points.device)
                for pool in (self.surface, self.volume)
            )
            points = torch.cat((self.surface.points[on], self.volume.points[around]))
            f, gradient = by_autograd(weights, points)
            for network in earlier:
                value_part, gradient_part = by_autograd(network, points)
                f, gradient = f + value_part, gradient + gradient_part.detach()
            assert self.surface.normals is not None
            total = loss(f, gradient, self.surface.normals[on])
            optimizer.zero_grad()
            total.backward()  # type: ignore[no-untyped-call]
            optimizer.step()

        return run


def loss(f: Tensor, gradient: Tensor, normals: Tensor) -> Tensor:
    """Compute the loss of `trainer.level` (Eq. 4) for distances of zero; the first points have the normals."""
    half = len(normals)
    weight = LossConfig.residual
    total: Tensor = (
        weight.value * f[:half].square().mean()
        + weight.normal * (1 - functional.cosine_similarity(gradient[:half], normals, dim=1)).mean()
        + weight.distance * f[half:].square().mean()
        + weight.eikonal * (torch.linalg.vector_norm(gradient, dim=1) - 1).square().mean()
    )
    return total


def our_settings(device: torch.device) -> None:
    """Prepare PyTorch as `mplicits train` does."""
    machine.prepare(device)


def default_settings() -> None:
    """Set PyTorch's own precision and number of threads."""
    torch.set_num_threads(THREADS)
    torch.set_float32_matmul_precision("highest")


def seconds(step: Callable[[], None]) -> float:
    """Measure how long a step takes."""
    began = time.perf_counter()
    step()
    if torch.cuda.is_available():
        torch.cuda.synchronize()
    return time.perf_counter() - began


def apart(connection: Connection, index: int, device: torch.device, points: int) -> None:
    """Run the authors' way in this process: for every true message, send the seconds of one step."""
    step = Case(index, device, points).authors()
    connection.send(0.0)
    while connection.recv():
        connection.send(seconds(step))


def medians(index: int, device: torch.device, points: int, rounds: int) -> list[float]:
    """Measure the median seconds of a step: ours, autograd, the authors' way in this process, and in another.

    They take turns, `rounds` of which count. Each turn begins with what is not timed: its settings, a rest, and `WARM`
    steps, since in training one step follows another.
    """
    case = Case(index, device, points)
    near, far = multiprocessing.get_context("spawn").Pipe()
    other = multiprocessing.get_context("spawn").Process(target=apart, args=(far, index, device, points))
    other.start()
    near.recv()

    def elsewhere() -> float:
        near.send(True)
        return float(near.recv())

    steps: tuple[tuple[Callable[[], None], Callable[[], float]], ...] = (
        (partial(our_settings, device), partial(seconds, case.ours())),
        (partial(our_settings, device), partial(seconds, case.autograd())),
        (default_settings, partial(seconds, case.authors())),
        (default_settings, elsewhere),
    )
    times: list[list[float]] = [[] for _ in steps]
    for done in range(rounds + 1):
        for (prepare, step), step_times in zip(steps, times, strict=True):
            prepare()
            time.sleep(REST)
            turn = [step() for _ in range(WARM + TIMED)][WARM:]
            if done:
                step_times.extend(turn)
    near.send(False)
    other.join()
    return [statistics.median(step_times) for step_times in times]


def main() -> None:
    """Measure all rows, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=int, default=8192, help="samples of a step")
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/train_step.md"))
    options = parser.parse_args()
    device = torch.device(options.device)
    our_settings(device)
    on = f"{torch.cuda.get_device_name()}; " if device.type == "cuda" else ""
    page = protocol.Page(
        options.output,
        "# One training step",
        "",
        f"Printed by `python benchmarks/train_step.py`. {on}{protocol.machine()}, {THREADS} threads.",
        "",
        f"{options.points} points a step, medians of {options.rounds * TIMED} steps in turn. The authors' way "
        "evaluates earlier levels in each step; it also runs in a process of its own with PyTorch's defaults, and the "
        "faster of the two counts.",
        "",
        "| residual | after | ours, ms | autograd, ms | authors' way, ms | in its own process, ms "
        "| autograd / ours | authors' / ours |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    )
    for index, (sizes, size) in enumerate(CASES):
        ours, autograd, authors, alone = medians(index, device, options.points, options.rounds)
        names = [f"{width}x{depth}" for width, depth in (size, *sizes)]
        figures = " | ".join(f"{median * 1e3:.1f}" for median in (ours, autograd, authors, alone))
        page.add(
            f"| {names[0]} | {' + '.join(names[1:])} | {figures} | {autograd / ours:.2f} "
            f"| {min(authors, alone) / ours:.2f} |"
        )


if __name__ == "__main__":
    main()
