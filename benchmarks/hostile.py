"""Tries damaged files and absurd content, and counts what came out. Writes docs/results/hostile.md.

    PYTHONPATH=tests python benchmarks/hostile.py [--seed N] [--times 20] [--only WORD] [-o docs/results/hostile.md]

The cases are those of tests/fuzz; one that fails is kept in tests/fuzz/cases.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from fuzz import test_fuzz, test_hostile
from mplicits.bake import facts
from mplicits.bake.registry import TARGETS
from mplicits.capture import pairing
from mplicits.model.errors import UserError
from protocol import Page, machine
from support.fuzzing import Case, survive

MEANINGS = {
    "model": "a model's file, damaged",
    "packed": "a packed model's file, damaged",
    "shape": "meshes and clouds in nine formats, damaged",
    "checkpoint": "a checkpoint of the paper's authors, damaged",
    "part": "the state of a training, damaged",
    "command": "command lines",
    "scene": "a scene's file, damaged",
    "hostile scene": "scenes of numbers and groups at the edges",
    "hostile depth": "depth maps, cameras and options at the edges",
    "hostile cameras": "folders of photographs with spoiled cameras and masks",
    "hostile provenance": "doctored records of a training",
    "hostile log": "doctored logs of a training",
    "hostile arguments": "points, levels and times from Python",
    "hostile options": "options from Python, of any type",
}
"""Kind -> what its cases are."""


def counted(cases: Iterable[Case], use: Callable[[Path], None], folder: Path) -> tuple[int, int, int, list[str]]:
    """Use cases in a folder. Returns the numbers of cases, of results and of refusals, and a line for each failure."""
    results, refusals, listed = folder / "results", folder / "refusals", list(cases)

    def note(path: Path) -> None:
        with path.open("a") as file:
            file.write("x")

    def noted(path: Path) -> None:
        try:
            use(path)
        except UserError:
            note(refusals)
            raise
        note(results)

    results.touch()
    refusals.touch()
    failures = survive(listed, noted, folder, test_hostile.CASES)
    return len(listed), results.stat().st_size, refusals.stat().st_size, failures


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description="what comes out of damaged files and absurd content")
    parser.add_argument(
        "--seed", type=int, default=time.time_ns() // 1_000_000, help="of the cases (default: the time)"
    )
    parser.add_argument("--times", type=int, default=20, help="cases, times those of the fast tests (default 20)")
    parser.add_argument("--only", default="", metavar="WORD", help="kinds of that word, such as hostile")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/hostile.md"))
    options = parser.parse_args()
    only = f" --only {options.only}" if options.only else ""
    vars(facts)["TARGETS"] = {name: TARGETS[name] for name in ("shadertoy", "wgsl", "c", "python")}
    pairing.POINTS = test_hostile.FEW_POINTS
    page = Page(
        options.output.resolve(),
        "# Damaged files and absurd content",
        "",
        "Printed by `PYTHONPATH=tests python benchmarks/hostile.py "
        f"--seed {options.seed} --times {options.times}{only}`. {machine()}.",
        "",
        "Each case ends in a result, whose numbers are checked, or in one line. Failed: a traceback, several lines, a "
        "result that is wrong, more than 2 GB, more than 20 s of a processor, or a signal.",
        "",
        "| cases are | cases | results | refused in a line | failed |",
        "|---|---:|---:|---:|---:|",
    )
    failures = []
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        for kind, meaning in MEANINGS.items():
            if options.only not in kind:
                continue
            folder = Path(name, kind)
            folder.mkdir()
            if kind in test_fuzz.KINDS:
                use, count = test_fuzz.KINDS[kind]
                cases = list(test_fuzz.cases(kind, options.times * count, options.seed, folder))
            else:
                own = kind.removeprefix("hostile ")
                _, use, _, count = test_hostile.KINDS[own]
                cases = test_hostile.cases(own, options.times * count, options.seed)
            tried, results, refused, failed = counted(cases, use, folder)
            page.add(f"| {meaning} | {tried:,} | {results:,} | {refused:,} | {len(failed)} |")
            failures += failed
    for line in failures:
        print(line)


if __name__ == "__main__":
    main()
