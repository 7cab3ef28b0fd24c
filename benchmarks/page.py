"""Measure the html page in Chromium, and the bytes of it and of the Shadertoy text; writes docs/results/page.md.

    PYTHONPATH=tests python benchmarks/page.py MODEL... [-o docs/results/page.md]

Both variants of each page are measured as the page itself measures them: the seconds from handing the driver the text
to the end of a first draw of one pixel, and the milliseconds of one sample of every pixel of a canvas of 256x256.
"""

import argparse
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from browser_time import shown_seconds, turn
from mplicits.bake.registry import TARGETS
from mplicits.model.errors import UserError
from mplicits.model.gallery import model_path
from mplicits.model.model import Model, shape_of
from mplicits.model.model_file import load
from protocol import Page, machine
from support.browser import DRIVERS, chromium, visit

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SIDE = 256
"""Pixels along each side of the canvas."""
VIEWS = 3
"""Views in which a frame is timed."""
MEASURES = "() => performance.getEntriesByType('measure').map(({name, duration}) => [name, duration / 1000])"
"""Asks the page for the names and seconds of what its scripts measured."""


def main() -> None:
    """Write the table: a row for each model, driver and variant of the shader."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("models", nargs="+", type=model_path, metavar="MODEL")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/page.md"), metavar="FILE")
    parser.add_argument("--note", default="", help="what the models are, for the head of the table")
    arguments = parser.parse_args()
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"  # llvmpipe would bring what it compiled in the last run
    table = Page(
        arguments.output,
        "# The page on software GL",
        "",
        machine(),
        "",
        f"`python benchmarks/page.py {' '.join(path.stem for path in arguments.models)}`. "
        f"Canvas {SIDE}x{SIDE}, default view, Phong, all levels. Compile: from handing over the text to the end "
        f"of a first draw of one pixel, 60 s at most. Frame: one sample of every pixel, the fastest of {VIEWS} "
        f"views. {arguments.note}".rstrip(),
        "",
        "| model | levels | bytes of HTML | of Shadertoy text | driver | weights | compile + first draw, s | frame, ms "
        "| field error |",
        "|---|---|---:|---:|---|---|---:|---:|---:|",
    )
    for driver in DRIVERS:
        with chromium(driver) as browser, tempfile.TemporaryDirectory() as folder:
            for path in arguments.models:
                model = load(path)
                for storage in ("texture", "literal"):
                    row = measured(browser, model, storage, Path(folder) / "page.html")
                    sizes = " | ".join(size(model, target) for target in ("html", "shadertoy"))
                    levels = ", ".join(shape_of(level.network) for level in model.levels)
                    table.add(f"| {path.stem} | {levels} | {sizes} | {driver} | {storage} | {row} |")


def measured(browser: "Browser", model: Model, storage: str, file: Path) -> str:
    """Return the last three cells of a row, measured with the variant `storage` in a page written to `file`."""
    file.write_text(TARGETS["html"](model, shade="phong"), encoding="utf-8")
    memory = f"mplicits {model.sha256()}"
    remember = f"localStorage.setItem('{memory}', '{storage}');"
    with visit(browser, file, size=(SIDE, SIDE), share=1, script=remember) as visited:
        visited.still()
        visited.until("!document.getElementById('status').textContent.includes('trying')")
        if visited.root("storage") != storage:
            return "given up, the page stays with the texture | - | -"
        frames = []
        for _ in range(VIEWS):
            turn(visited, "ArrowRight")
            frames.append(1000 * shown_seconds(visited))
            assert f"{SIDE} × {SIDE}" in visited.page.inner_text("#status")
        times = dict(visited.page.evaluate(MEASURES))
        assert not visited.said, visited.said
        compiled, error = times[f"{storage}: compiled and first drawn"], float(visited.root("error") or "nan")
        return f"{compiled:.2f} | {min(frames):.0f} | {error:.1e}"


def size(model: Model, target: str) -> str:
    """Return the bytes of a target's text as a cell of the table, or that it does not take the model."""
    try:
        return f"{len(TARGETS[target](model).encode()):,}"
    except UserError:
        return "-"


if __name__ == "__main__":
    main()
