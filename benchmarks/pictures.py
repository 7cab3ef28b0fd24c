"""Takes the pictures of the docs anew: the gallery's, the web page's and the window's.

    PYTHONPATH=tests python benchmarks/pictures.py [--only gallery | page | view]

Writes docs/gallery.md, docs/gallery/ and docs/demo.png (gallery.py), docs/page.png and docs/view.png. Needs Chromium
and Xvfb.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from mplicits.model.gallery import model_path
from mplicits.model.model_file import load
from mplicits.web.page import standalone
from support.browser import chromium, visit
from support.display import virtual_display
from support.window_script import run

DOCS = Path(__file__).parents[1] / "docs"
MODEL = "spot"
"""Name of the model that page and window show."""
PAGE, WINDOW = (1100, 688), (960, 600)
"""CSS pixels of the page, and pixels of the window."""
PATIENCE = 1_800_000
"""Most milliseconds of the page's picture."""
VIEW = """
from PIL import Image
view.set(samples=16, shade="softbox")
view.look_from(FRONT)
settle(500)
Image.fromarray((255 * screen() + 0.5).astype(np.uint8)).save("view.png")
"""
"""Saves what the window shows."""


def take_gallery() -> None:
    """Run gallery.py."""
    script = Path(__file__).with_name("gallery.py")
    subprocess.run([sys.executable, str(script), "-o", str(DOCS / "gallery.md")], check=True)


def take_page() -> None:
    """Write docs/page.png, a screenshot of the refined picture beside the panel."""
    with TemporaryDirectory() as folder, chromium() as browser:
        path = Path(folder) / "page.html"
        path.write_text(standalone(load(model_path(MODEL))))
        with visit(browser, path, PAGE, 1) as visited:
            visited.page.set_default_timeout(PATIENCE)
            visited.still()
            visited.unfold()
            visited.still()
            visited.page.screenshot(path=str(DOCS / "page.png"))


def take_view() -> None:
    """Write docs/view.png, the window at rest."""
    with TemporaryDirectory() as folder, virtual_display("{}x{}".format(*WINDOW)) as environment:
        shutil.copy(model_path(MODEL), Path(folder) / "m.safetensors")
        run(VIEW.replace("FRONT", repr(load(model_path(MODEL)).front)), WINDOW, Path(folder), environment)
        shutil.copy(Path(folder) / "view.png", DOCS / "view.png")


TAKES = {"gallery": take_gallery, "page": take_page, "view": take_view}
"""Name of a choice -> what takes its pictures."""


def main() -> None:
    """Take all pictures, or those of one choice."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=TAKES, help="take these alone")
    options = parser.parse_args()
    for name, take in TAKES.items():
        if options.only in (None, name):
            take()


if __name__ == "__main__":
    main()
