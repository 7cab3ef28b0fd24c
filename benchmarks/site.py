"""Draws docs/gallery.png: the index of the site that `mplicits gallery` makes, in Chromium.

PYTHONPATH=tests python benchmarks/site.py [--site FOLDER] [-o docs/gallery.png]
"""

import argparse
import tempfile
from pathlib import Path

from PIL import Image

from mplicits.site.write import INDEX, write_site
from support.browser import chromium
from support.paths import ROOT

WIDTH, SHARE = 1200, 1
"""CSS pixels of the window, and pixels for each of them."""


def main() -> None:
    """Make the site, and draw its whole first page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--site", type=Path, metavar="FOLDER", help="a site of `mplicits gallery`; else it is made")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "gallery.png")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        site = options.site or Path(folder) / "site"
        if options.site is None:
            write_site(site, None, "Neural shapes")
        page = browser.new_page(
            viewport={"width": WIDTH, "height": 100}, device_scale_factor=SHARE, color_scheme="light"
        )
        page.goto((site / INDEX).absolute().as_uri())
        page.wait_for_function("() => [...document.images].every((image) => image.complete && image.naturalWidth)")
        page.screenshot(path=options.output, full_page=True)
    Image.open(options.output).convert("RGB").save(options.output, optimize=True)


if __name__ == "__main__":
    main()
