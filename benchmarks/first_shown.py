"""Measure what a window and a page show first, and when; writes docs/results/first_shown.md.

    PYTHONPATH=tests python benchmarks/first_shown.py [spot-small spot] [--rounds 3] [-o FILE]

The window is `mplicits view` on a screen that nobody sees, whose pixels are looked at every 10 ms from the command on.
The page is opened as a file by a browser that runs already, and says itself when it painted what.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mplicits.bake.registry import TARGETS
from mplicits.model.gallery import model_path
from mplicits.model.model import shape_of
from mplicits.model.model_file import load
from protocol import Page, machine
from support.browser import chromium, visit
from support.display import virtual_display

SIZE = (1280, 800)
"""Of the screen, in pixels."""
PATIENCE = 120.0
"""Most seconds that are waited for a picture."""
COLOURS = 300
"""A screen with more of them shows a shape: a window's greeting has some 60."""
START = 0.5
"""Seconds until an empty screen is black."""
DRAWN = """
const seen = new MutationObserver(() => {
    if ("drawn" in document.documentElement.dataset) { performance.mark("drawn"); seen.disconnect(); }
});
seen.observe(document, {attributes: true, subtree: true, attributeFilter: ["data-drawn"]});
"""
ENTRIES = "() => performance.getEntries().map(({name, startTime}) => [name, startTime / 1000])"

Pixels = NDArray[np.uint32]


def pixels(file: Path) -> Pixels:
    """Read what a screen shows, from the file in which Xvfb keeps it (X11/XWDFile.h). Returns (N,) colours."""
    data = file.read_bytes()
    header = np.frombuffer(data[:100], ">u4")
    return np.frombuffer(data, "<u4", offset=int(header[0] + 12 * header[19]))


def window_seconds(model: Path) -> tuple[float, float]:
    """Open the viewer on a model. Returns the seconds from the command to its window, and to a picture of the shape."""
    with (
        tempfile.TemporaryDirectory() as folder,
        virtual_display("x".join(map(str, SIZE)), Path(folder)) as environment,
    ):
        screen = Path(folder) / "Xvfb_screen0"
        time.sleep(START)
        before = pixels(screen)
        programs = {"MESA_SHADER_CACHE_DIR": str(Path(folder) / "programs")}
        began = time.perf_counter()

        def until(is_shown: Callable[[Pixels], bool]) -> float:
            while time.perf_counter() - began < PATIENCE:
                if is_shown(pixels(screen)):
                    return time.perf_counter() - began
                time.sleep(0.01)
            return float("inf")

        process = subprocess.Popen([sys.executable, "-m", "mplicits", "view", str(model)], env=environment | programs)
        try:
            opened = until(lambda now: not np.array_equal(now, before))
            return opened, until(lambda now: len(np.unique(now)) > COLOURS)
        finally:
            process.terminate()
            process.wait()


def page_seconds(page: Path) -> tuple[float, float]:
    """Open a page. Returns the seconds from its address to its poster, and to its own frame in the poster's place."""
    with chromium() as browser, visit(browser, page, SIZE, share=1.0, script=DRAWN) as visited:
        visited.until("performance.getEntriesByName('drawn').length > 0")
        entries: dict[str, float] = dict(visited.page.evaluate(ENTRIES))
        return entries["first-contentful-paint"], entries["drawn"]


def main() -> None:
    """Open each model in both, and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", nargs="*", default=["spot-small", "spot"])
    parser.add_argument("--rounds", type=int, default=3, help="times that each is opened")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/first_shown.md"))
    args = parser.parse_args()
    load_average = os.getloadavg()[0]
    page = Page(
        args.output,
        "# What is shown first",
        "",
        f"Printed by `PYTHONPATH=tests python benchmarks/first_shown.py {' '.join(args.models)} "
        f"--rounds {args.rounds}`: {machine()}; load average at the start {load_average:.1f}. "
        f"{SIZE[0]} x {SIZE[1]} pixels, in the studio. Seconds by the clock, medians. The window: from the command, "
        "Python's start and imports among them, to the open window, which says that it compiles, and to a picture of "
        "the shape; Mesa had no compiled programs on disk. The page: from its address to its poster, a picture of the "
        "first view, and to the first frame of its own that is finer, in Chromium on SwiftShader.",
        "",
        "| model | levels | window | its picture | page's poster | its own frame |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    )
    for name in args.models:
        path = model_path(name)
        model = load(path)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "page.html"
            file.write_text(TARGETS["html"](model), encoding="utf-8")
            rounds = [(*window_seconds(path), *page_seconds(file)) for _ in range(args.rounds)]
        levels = " > ".join(shape_of(level.network) for level in model.levels)
        medians = " | ".join(f"{statistics.median(seconds):.1f}" for seconds in zip(*rounds, strict=True))
        page.add(f"| {name} | {levels} | {medians} |")


if __name__ == "__main__":
    main()
