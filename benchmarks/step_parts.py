"""Measure what bounds one training step: products, sines, memory, or what every call costs; writes a page.

    python benchmarks/step_parts.py [--rounds 12] [-o docs/results/step_parts.md]

The parts are those of `adjoint_pass` and `add_derivative`, each done alone on arrays of the step's sizes, in turn with
whole steps and with steps done the authors' way (benchmarks/train_step.py).
"""

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

from mplicits.trainer import cli

if __name__ == "__main__":
    cli.before_torch()

import torch

import train_step
from mplicits.trainer import level
from mplicits.trainer.networks import network
from protocol import Page, machine

POINTS = 8192
"""Samples of a step."""
FEW = 64
"""Samples of a step that costs hardly more than its calls."""
PRODUCTS, PASSES = 6, 5
"""Products of a hidden layer; element-wise operations of a sine layer, beside its sine and its cosine."""
LARGE = 2048
"""Rows and columns of the product that says what the cores can do."""

Part = Callable[[], object]


def parts(size: tuple[int, int]) -> dict[str, Part]:
    """Make the parts of a step of a network of (width, depth)."""
    width, depth = size
    here, there = (torch.rand(POINTS, width) for _ in range(2))
    other = torch.ones(POINTS, width)  # repeated products with anything smaller end in slow denormal numbers
    weight, gradient = torch.rand(width, width) / width, torch.zeros(width, width)
    first, points = torch.rand(width, 3), torch.rand(POINTS, 3)

    def products() -> None:
        for _ in range(depth):
            for _ in range(PRODUCTS - 2):
                torch.mm(here, weight, out=there)
            for _ in range(2):
                gradient.addmm_(here.t(), there)
        for _ in range(2):  # the first layer's, of three columns
            torch.mm(points, first.t(), out=there)
            torch.mm(here, first)

    def sines() -> None:
        for _ in range(depth + 1):
            network.cos(here)
            network.sin_(there)

    def passes() -> None:
        for _ in range(depth + 1):
            there * other
            here * other
            here.mul_(other)
            there.mul_(other).addcmul_(here, other, value=-1)

    return {"products": products, "sines": sines, "passes over memory": passes}


def whole(index: int, points: int, ours: bool) -> Part:
    """Make a step of a case of `train_step` on so many points: ours, or the authors' way."""
    level.BATCH = points
    case = train_step.Case(index)
    return case.ours() if ours else case.authors()


def milliseconds(part: Part, times: int = 4) -> float:
    """Measure the shortest of some calls; what else the machine does lengthens the others."""
    found = []
    for _ in range(times):
        began = time.perf_counter()
        part()
        found.append((time.perf_counter() - began) * 1e3)
    return min(found)


def row(index: int, rounds: int) -> str:
    """Measure one case. Returns its line of the table."""
    sizes, (width, depth) = train_step.CASES[index]
    batch = level.BATCH
    few, step, authors = (whole(index, n, own) for n, own in ((FEW, True), (POINTS, True), (POINTS, False)))
    square = torch.rand(LARGE, LARGE)
    measured: dict[str, Part] = {"step": step, "calls": few, **parts((width, depth)), "large": lambda: square @ square}
    found: dict[str, list[float]] = {name: [] for name in [*measured, "authors"]}
    for _ in range(rounds):
        train_step.our_settings()
        level.BATCH = POINTS
        for name, part in measured.items():
            found[name].append(milliseconds(part))
        train_step.default_settings()
        found["authors"].append(milliseconds(authors))
    level.BATCH = batch
    median = {name: statistics.median(column) for name, column in found.items()}
    flops = 2 * POINTS * width * width * PRODUCTS * depth
    rate, most = flops / median["products"] / 1e6, 2 * LARGE**3 / median["large"] / 1e6
    cells = [f"{median[name]:.1f}" for name in ("step", "products", "sines", "passes over memory", "calls")]
    shown = [f"{width}x{depth}", " + ".join(f"{n}x{d}" for n, d in sizes), *cells]
    ends = [f"{rate:.0f} of {most:.0f}", f"{median['authors']:.1f}", f"{median['authors'] / median['step']:.2f}"]
    bound = median["authors"] / (median["products"] + median["sines"])
    return f"| {' | '.join([*shown, *ends, f'{bound:.2f}'])} |"


def main() -> None:
    """Measure all cases, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/step_parts.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# What bounds a training step",
        "",
        f"Printed by `python benchmarks/step_parts.py --rounds {options.rounds}`: milliseconds of a step of {POINTS} "
        "points of our trainer, and of its parts done alone on arrays of the same sizes: matrix products, sines and "
        f"cosines, element-wise operations, and a whole step of {FEW} points, which is what the calls cost. Medians "
        "over rounds of the shortest of four. GFLOP/s: of these products, and of one of "
        f"{LARGE} x {LARGE} matrices. The last column is the ratio that would be left if only products and sines "
        "took time.",
        "",
        f"{machine()}, {train_step.THREADS} threads.",
        "",
        "| residual | after | step | products | sines | passes over memory | calls | products, GFLOP/s | authors' way "
        "| authors' / ours | authors' / (products + sines) |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    )
    for index in range(len(train_step.CASES)):
        page.add(row(index, options.rounds))


if __name__ == "__main__":
    main()
