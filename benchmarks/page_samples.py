"""Compares the page's samples along the edges with samples everywhere: writes docs/results/page_samples.md.

    PYTHONPATH=tests python benchmarks/page_samples.py MODEL... [--side 512] [--weights literal] [-o FILE]

A page's text as it is, and with lines changed so that no pixel is left out; all refine for as long as it takes.
"""

import argparse
import io
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from browser_time import changed, processor_seconds, turn
from mplicits.model.gallery import model_path
from mplicits.model.model import Model, shape_of
from mplicits.model.model_file import load
from mplicits.web.page import standalone
from protocol import Page, machine
from support.browser import chromium, visit

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ALONG, EVERYWHERE, FOUR = "along the edges", "everywhere", "four everywhere"
ADAPTS = "get adapts() {"
WAYS = {ALONG: [], EVERYWHERE: [(ADAPTS, f"{ADAPTS} return false;")]}
WAYS[FOUR] = [*WAYS[EVERYWHERE], ("const SAMPLES = 16;", "const SAMPLES = 4;")]
"""What is changed in the page's text."""
PATIENCE = "const PATIENCE = 15000;", "const PATIENCE = 1500000;"


def refined(
    browser: "Browser", model: Model, weights: str, text: str, side: int, folder: Path
) -> tuple[NDArray[np.float64], float]:
    """Return the picture at rest of a page, and the processor's seconds from a change of the view to there."""
    (folder / "page.html").write_text(text, encoding="utf-8")
    remember = f"localStorage.setItem('mplicits {model.sha256()}', '{weights}');"
    with visit(browser, folder / "page.html", (side, side), 1, remember, "#panel=0") as visited:
        visited.until(f"document.documentElement.dataset.storage === '{weights}'")
        visited.still()
        visited.page.keyboard.press("ArrowLeft")
        visited.still()
        began = processor_seconds()
        turn(visited, "ArrowRight")
        seconds = processor_seconds() - began
        png = Image.open(io.BytesIO(visited.page.locator("#view").screenshot())).convert("RGB")
        assert not visited.said, visited.said
    return np.asarray(png, np.float64) / 255, seconds


def main() -> None:
    """Draw every model in each way, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--side", type=int, default=512)
    parser.add_argument("--weights", choices=("literal", "texture"), default="literal")
    parser.add_argument("--shades", default="phong,studio")
    parser.add_argument("--add", action="store_true", help="add rows to the page that is there")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/page_samples.md"))
    args = parser.parse_args()
    head = [
        "# The page's samples along the edges",
        "",
        f"Printed by `benchmarks/page_samples.py`: {machine()}. Chromium on SwiftShader, the first view, as many "
        "pixels a side as the table says. PSNR of the screen's 8 bits against 16 samples everywhere; work: the "
        "processor's seconds of all the browser's processes, from a change of the view to the picture at rest, "
        "over those of 4 samples everywhere, once each.",
        "",
        "| model | levels | weights | shading | side | 4 everywhere | 16 along the edges | its work "
        "| work of 16 everywhere |",
        "| --- | --- | --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    page = Page(args.output, *(args.output.read_text().splitlines() if args.add else head))
    with chromium() as browser, tempfile.TemporaryDirectory() as folder:
        for name in args.models:
            model = load(model_path(name))
            levels = " > ".join(shape_of(level.network) for level in model.levels)
            for shade in args.shades.split(","):
                text = changed(standalone(model, shade=shade), [PATIENCE])
                drawn = {
                    way: refined(browser, model, args.weights, changed(text, changes), args.side, Path(folder))
                    for way, changes in WAYS.items()
                }
                truth, most = drawn.pop(EVERYWHERE)
                quality = {way: -10 * np.log10(((picture - truth) ** 2).mean()) for way, (picture, _) in drawn.items()}
                page.add(
                    f"| {model.name} | {levels} | {args.weights} | {shade} | {args.side} | {quality[FOUR]:.1f} dB | "
                    f"{quality[ALONG]:.1f} dB | {drawn[ALONG][1] / drawn[FOUR][1]:.2f} | {most / drawn[FOUR][1]:.2f} |"
                )


if __name__ == "__main__":
    main()
