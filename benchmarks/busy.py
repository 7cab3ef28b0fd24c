"""Measure what busy programs beside a training do to it; writes docs/results/busy.md.

    python benchmarks/busy.py [--shape demo] [--levels 64x1,64x2,64x2] [--steps 300,600] [--seconds 40] [--loops 2]
        [--rounds 2] [-o FILE]

The same training runs alone, and beside processes that do nothing but count: once with a number of steps, once for a
number of seconds. They take turns.
"""

import argparse
import multiprocessing
import statistics
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from large_meshes import measured, train_command
from mplicits.model.model_file import load
from protocol import Page, machine


@dataclass(frozen=True)
class Run:
    """What came of one training."""

    clock: float
    """Seconds by the clock."""
    processor: float
    """Seconds of the processor."""
    steps: tuple[int, ...]
    """Of each level."""
    restarts: int
    failed: int
    """Levels that learnt nothing."""
    mean_f: float


def spin() -> None:
    """Count for ever."""
    count = 0
    while True:
        count += 1


@contextmanager
def loops(count: int) -> Iterator[None]:
    """Keep so many processes busy."""
    busy = [multiprocessing.Process(target=spin, daemon=True) for _ in range(count)]
    with ExitStack() as stack:
        for process in busy:
            process.start()
            stack.callback(process.kill)
        yield


def train(options: argparse.Namespace, length: list[str]) -> Run:
    """Train once. length: the options for steps or seconds."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "m.safetensors"
        clock, processor, _ = measured(train_command(options.shape, options.levels, length, output))
        model = load(output)
    records = model.provenance["levels"]
    idle = sum(not network[-1].weight.any() for network in (level.network for level in model.levels))
    steps = tuple(record["steps"] for record in records)
    return Run(clock, processor, steps, sum(r["restarts"] for r in records), idle, records[-1]["mean_f"])


def main() -> None:
    """Train by steps and by seconds, alone and beside the loops, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shape", default="demo")
    parser.add_argument("--levels", default="64x1,64x2,64x2", metavar="NxD,..")
    parser.add_argument("--steps", default="300,600", metavar="N,..")
    parser.add_argument("--seconds", default="40", metavar="S")
    parser.add_argument("--loops", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/busy.md"))
    options = parser.parse_args()
    page = Page(
        options.output,
        "# Training on a busy machine",
        "",
        f"Printed by `python benchmarks/busy.py --shape {options.shape} --levels {options.levels} --steps "
        f"{options.steps} --seconds {options.seconds} --loops {options.loops} --rounds {options.rounds}`: `mplicits "
        f"train` alone, and beside {options.loops} processes that only count, in turn; medians, from the command to "
        "the saved model. A level has failed where its network ends as zero.",
        "",
        f"{machine()}.",
        "",
        "| length | beside it | seconds by the clock | times as long | seconds of the processor | steps | restarts "
        "| failed levels | mean abs f |",
        "| --- | --- | ---: | ---: | ---: | --- | ---: | ---: | ---: |",
    )
    for name, value in (("--steps", options.steps), ("--seconds", options.seconds)):
        runs: dict[int, list[Run]] = {0: [], options.loops: []}
        for _ in range(options.rounds):
            for count, done in runs.items():
                with loops(count):
                    done.append(train(options, [name, value]))
        usual = statistics.median(run.clock for run in runs[0])
        for count, done in runs.items():
            clock = statistics.median(run.clock for run in done)
            processor = statistics.median(run.processor for run in done)
            mean_f = statistics.median(run.mean_f for run in done)
            page.add(
                f"| {name} {value} | {f'{count} loops' if count else 'nothing'} | {clock:.0f} | {clock / usual:.2f} "
                f"| {processor:.0f} | {'; '.join(', '.join(map(str, run.steps)) for run in done)} "
                f"| {sum(run.restarts for run in done)} | {sum(run.failed for run in done)} | {mean_f:.2e} |"
            )


if __name__ == "__main__":
    main()
