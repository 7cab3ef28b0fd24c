"""Draws the README's pictures of the page and of the window, with Spot: writes docs/page.png and docs/view.png.

    PYTHONPATH=tests python benchmarks/screens.py [--page] [--view]

Both are as they open, at rest: the page in Chromium on SwiftShader, the window under Xvfb.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from mplicits.bake.registry import TARGETS
from mplicits.model.gallery import model_path
from mplicits.model.model_file import load
from mplicits.viewer.arguments import camera_from, options_from
from mplicits.viewer.cli import view_arguments
from support.browser import chromium, visit
from support.display import virtual_display

MODEL = "spot"
PAGE, WINDOW = (1100, 688), (960, 600)
"""Sizes, pixels."""


def draw_page(path: Path) -> None:
    """Draw the page when it has chosen how its weights are stored and is at rest."""
    with chromium() as browser, tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "page.html"
        file.write_text(TARGETS["html"](load(model_path(MODEL))), encoding="utf-8")
        with visit(browser, file, PAGE, share=1) as visited:
            visited.until("!document.getElementById('status').textContent.includes('trying')")
            visited.still()
            visited.page.evaluate("document.getElementById('status').textContent = ''")  # seconds without a GPU
            visited.page.screenshot(path=path)
            assert not visited.said, visited.said


def draw_window(path: Path) -> None:
    """Draw the window that `mplicits view` opens, when it is at rest."""
    with virtual_display(f"{WINDOW[0]}x{WINDOW[1]}") as environment:
        os.environ.update(environment)
        import glfw

        from mplicits.viewer.state.source import open_source
        from mplicits.viewer.window.greeting import greeted
        from mplicits.viewer.window.window import Window

        parser = argparse.ArgumentParser()
        view_arguments(parser)
        args = parser.parse_args([MODEL, "--size", f"{WINDOW[0]}x{WINDOW[1]}"])
        with greeted(MODEL, WINDOW, None) as (context, gui):
            source = open_source(args.model, args.storage)
            window = Window(context, gui, source, camera_from(args, source.front), options_from(args))
            while not window.desk.resting or (window.gui is not None and window.gui.restless):
                window.step()
                glfw.poll_events()
                time.sleep(0.002)
            window.paint(swap=False)
            with context as gl:
                data = gl.screen.read(viewport=(0, 0, *WINDOW), components=3)
            window.close()
    Image.fromarray(np.frombuffer(data, np.uint8).reshape(WINDOW[1], WINDOW[0], 3)[::-1]).save(path, optimize=True)


def main() -> None:
    """Draw what the command line asks for, or both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--view", action="store_true")
    options = parser.parse_args()
    docs = Path(__file__).parents[1] / "docs"
    if options.page or not options.view:
        draw_page(docs / "page.png")
    if options.view or not options.page:
        draw_window(docs / "view.png")


if __name__ == "__main__":
    main()
