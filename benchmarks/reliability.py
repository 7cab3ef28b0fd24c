"""Loads, draws, turns, loses contexts, kills and damages without end: writes docs/results/reliability.md.

    python benchmarks/reliability.py [-o FILE] [--loads N] [--starts N] [--renders N] [--turntable SECONDS]
                                     [--resizes N] [--losses N] [--kills N] [--torn N] [--resumes N] [--rounds N]

What is measured is what docs/reliability.md promises: memory that does not grow, training that a kill costs no more
than 30 s of, files that are whole, and one line for whatever is damaged. Only what is asked for is measured; the page
keeps the other rows as earlier runs have left them, each with its day. Each row is a process of its own.
"""

import argparse
import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import kills
import soak
import soak_page
from protocol import machine

HEAD = """# Reliability: the last figures

By `python benchmarks/reliability.py --loads 20000 --starts 20 --renders 2000 --turntable 3600 --resizes 200
--losses 500 --kills 200 --resumes 3 --torn 200 --rounds 20`, or a run of some of these: what was done, how often, where
and when is in the row. Memory and objects are those after the first 30 % of the looks, and growth is the slope of a
straight line.

| what | how often | outcome | machine |
| --- | ---: | --- | --- |
"""
Row = tuple[str, str, Callable[[int, Path], str]]
"""The words of a row, what is counted, and what measures it: given the count and an empty folder, it tells of it."""
ROWS: dict[str, Row] = {
    "loads": ("a model is loaded", "", soak.loads),
    "starts": ("mplicits starts, up to where it sees to Ctrl-C", "", soak.starts),
    "renders": ("a renderer is made, draws and is released", "", soak.renders),
    "turntable": ("the turntable of a window", " s", soak.turntable),
    "resizes": ("a window gets another size", "", soak.resizes),
    "losses": ("the web page loses its context, and gets it back", "", soak_page.losses),
    "kills": ("`kill -9` in a training, which the next one resumes", "", kills.trainings),
    "resumes": ("a training by the clock, `--seconds`, is ended half-way and gone on with", " seeds", kills.resumed),
    "torn": ("`kill -9` in the writing of a file", "", kills.writings),
    "rounds": ("damaged files and command lines, rounds of some 500", "", kills.damages),
}


def main() -> None:
    """Parse the arguments, measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/reliability.md"))
    for name, (words, unit, _) in ROWS.items():
        parser.add_argument(f"--{name}", type=int, default=0, metavar="SECONDS" if unit == " s" else "N", help=words)
    asked = vars(parser.parse_args())
    output = asked["output"].absolute()
    for name, (words, unit, measure) in ROWS.items():
        if not asked[name]:
            continue
        with (
            tempfile.TemporaryDirectory() as folder,
            ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process,
        ):
            outcome = process.submit(_in, Path(folder), measure, asked[name]).result()
        line = f"| {words} | {asked[name]:,}{unit} | {outcome} | {machine()} |"
        print(line, flush=True)
        write(output, words, line)


def _in(folder: Path, measure: Callable[[int, Path], str], count: int) -> str:
    os.chdir(folder)
    return measure(count, folder)


def write(page: Path, words: str, line: str) -> None:
    """Put a row into the page, in the place of that of an earlier run. words: with which the row begins."""
    old = page.read_text(encoding="utf-8").splitlines() if page.exists() else []
    rows = {row: text for text in old for row, *_ in ROWS.values() if text.startswith(f"| {row} |")} | {words: line}
    table = [rows[row] for row, *_ in ROWS.values() if row in rows]
    page.write_text(HEAD + "\n".join(table) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
