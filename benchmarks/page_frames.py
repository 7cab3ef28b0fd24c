"""Compares the schedules of sphere tracing by the page's frames on SwiftShader: writes docs/results/page_frames.md.

    PYTHONPATH=tests python benchmarks/page_frames.py MODEL... [--side 512] [--weights literal] [--views 5] [-o FILE]

A page's text as it is, and with lines changed so that it traces by the plain schedule, in passes and at once.
"""

import argparse
import statistics
import tempfile
from contextlib import ExitStack
from pathlib import Path

from browser_time import changed, processor_seconds, shown_seconds, turn
from mplicits.model.gallery import model_path
from mplicits.model.model import shape_of
from mplicits.model.model_file import load
from mplicits.web.page import CELLS, DEAREST, standalone
from protocol import Page, machine
from support.browser import Visit, chromium, visit

PLAIN = [('"schedule": [1', '"schedule": [0'), ("first: Number(first)", "first: 0 * Number(first)")]
ONE_DRAW = [('storage === "literal" ? shared.passes : ["anywhere"]', 'storage === "" ? shared.passes : ["anywhere"]')]
WAYS = {"plain, at once": PLAIN + ONE_DRAW, "plain": PLAIN, "relaxed": []}
"""What is changed in the page's text."""
ONE_SAMPLE = [
    ("const SAMPLES = 16;", "const SAMPLES = 1;"),
    ("this.scene.cells = cells;", "this.scene.cells = cells; document.documentElement.dataset.cells = count;"),
]
"""What is changed in all: a picture at rest has one sample, and the page says which empty cells it has found."""
SMALL = 96
"""Pixels per side of a page while it compiles, and finds its cells."""


def frame(visited: Visit, key: str) -> tuple[float, float]:
    """Turn a page's view by a key; return the seconds of the whole frame, by the processor and as the page says it."""
    began = processor_seconds()
    turn(visited, key)
    return processor_seconds() - began, shown_seconds(visited)


def main() -> None:
    """Draw every model in each way, in turn, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--side", type=int, default=512)
    parser.add_argument("--weights", choices=("literal", "texture"), default="literal")
    parser.add_argument("--views", type=int, default=5)
    parser.add_argument("--add", action="store_true", help="add rows to the page that is there")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/page_frames.md"))
    args = parser.parse_args()
    head = [
        "# The page's frames on SwiftShader",
        "",
        f"Printed by `benchmarks/page_frames.py`: {machine()}. Chromium, Phong, one sample of each pixel, as many "
        "pixels a side as the table says. Seconds of a frame: the processor's, of all the browser's processes, "
        "from a turn of the view by 5 degrees to the picture at rest, a coarse one among them; median of the "
        "views, drawn in each way in turn. In brackets, frames per second by the clock, as the page says them; "
        "other programs ran. Times: the seconds of the plain schedule, drawn at once as all frames were once, over "
        "those of the relaxed one; median, and least, of the views.",
        "",
        "| model | levels | weights | side | views | plain, at once | plain | relaxed | times | least |",
        "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    page = Page(args.output, *(args.output.read_text().splitlines() if args.add else head))
    for name in args.models:
        model = load(model_path(name))
        text = changed(standalone(model, shade="phong"), ONE_SAMPLE)
        remember = f"localStorage.setItem('mplicits {model.sha256()}', '{args.weights}');"
        ways = WAYS if args.weights == "literal" else {way: WAYS[way] for way in ("plain, at once", "relaxed")}
        taken: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
        finest = CELLS["dear" if model.parameters() > DEAREST else "most"]
        with chromium() as browser, ExitStack() as open_pages:
            folder = Path(open_pages.enter_context(tempfile.TemporaryDirectory()))
            visits = {}
            for k, (way, changes) in enumerate(ways.items()):
                (folder / f"{k}.html").write_text(changed(text, changes), encoding="utf-8")
                opened = visit(browser, folder / f"{k}.html", (SMALL, SMALL), 1, remember, "#panel=0")
                visits[way] = open_pages.enter_context(opened)
                visits[way].patience = 3_600_000
                visits[way].until(f"document.documentElement.dataset.storage === '{args.weights}'")
                visits[way].until(f"document.documentElement.dataset.cells >= {finest}")
                visits[way].still()
            for k in range(args.views):
                for way, visited in visits.items():
                    visited.page.bring_to_front()
                    visited.page.set_viewport_size({"width": args.side, "height": args.side})
                    visited.until(f"document.getElementById('view').width === {args.side}")
                    taken[way].append(frame(visited, "ArrowRight" if k % 2 == 0 else "ArrowUp"))
            assert not any(visited.said for visited in visits.values())
        cells = ["-" if way not in taken else median(taken[way]) for way in WAYS]
        old, new = ([seconds for seconds, _ in taken[way]] for way in ("plain, at once", "relaxed"))
        times = [one / other for one, other in zip(old, new, strict=True)]
        levels = " > ".join(shape_of(level.network) for level in model.levels)
        page.add(
            f"| {model.name} | {levels} | {args.weights} | {args.side} | {args.views} | {' | '.join(cells)} | "
            f"{statistics.median(times):.2f} | {min(times):.2f} |"
        )


def median(taken: list[tuple[float, float]]) -> str:
    """Return a cell of the table: the median of the processor's seconds, and of the frames per second."""
    seconds, shown = (statistics.median(values) for values in zip(*taken, strict=True))
    return f"{seconds:.2f} s ({1 / shown:.2f})"


if __name__ == "__main__":
    main()
