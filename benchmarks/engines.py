"""Draws docs/element.png and docs/three.png, the pictures of docs/engines.md, and measures the latter.

    PYTHONPATH=tests python benchmarks/engines.py [--bytes]

docs/three.png shows a scene of three.js with a traced model, and the same scene with its meshed copy.
"""

import argparse
import gzip
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import mplicits
from mplicits.web.module import baked
from support.browser import chromium
from support.module_pages import drawn, module_page, three_page
from support.paths import ROOT

SIDE = 480
"""Pixels along each side of a picture of the scene."""
MODELS = ("spot-small", "spot")
"""Models of the gallery whose modules are measured; the first one is drawn."""
CELLS = 192
"""Cells of the meshed copy, along an edge."""
APART = 60
"""Sum of the channels' differences, of 255 each, above which two pixels differ."""
PAGE = """<style>
body { margin: 24px; font: 17px/1.5 system-ui, sans-serif; background: #fff; color: #222; }
figure { float: left; margin: 0 24px 8px 0; }
mplicits-view { width: 300px; height: 300px; border-radius: 16px; }
</style>
<figure><mplicits-view alt="Spot the cow" camera-controls background="paper"></mplicits-view></figure>
<h2>Spot</h2><p>Text of a page, beside a model that its visitor can turn: one tag, one module.</p>
<mplicits-view id="small" alt="Spot from behind" camera-orbit="35deg 70deg auto" shade="phong" background="sky"
    style="width: 140px; height: 140px"></mplicits-view>"""


def main() -> None:
    """Draw the pictures, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs", help="folder of the pictures")
    parser.add_argument("--bytes", action="store_true", help="print the bytes of the modules alone")
    options = parser.parse_args()
    for name in MODELS:
        data = baked(mplicits.load(name).model).text.encode()
        print(f"module of {name}: {len(data):,} bytes, {len(gzip.compress(data, 9)):,} in gzip")
    if options.bytes:
        return
    field = mplicits.load(MODELS[0])
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        path = Path(folder) / "page.html"
        path.write_text(module_page(field, PAGE), encoding="utf-8")
        page = browser.new_page(viewport={"width": 720, "height": 350}, color_scheme="light")
        page.goto(path.as_uri())
        # In this order, each element draws alone; the renderer refines for some seconds more.
        page.wait_for_function(
            "() => [...document.querySelectorAll('mplicits-view')].every((view) => view.modelIsVisible)"
        )
        page.evaluate("() => Promise.all([...document.querySelectorAll('mplicits-view')].map((view) => view.toBlob()))")
        page.screenshot(path=options.output / "element.png")
        page.close()
        page = browser.new_page()
        setup = {"size": SIDE, "lit": True, "ground": -0.62, "box": [0.35, 0.1, 0.55], "turn": 3.4}
        page.goto(three_page(field, Path(folder), cells=CELLS, **setup).as_uri())
        page.wait_for_function("() => window.draw")
        traced, meshed = drawn(page, True), drawn(page, False)
    Image.fromarray(np.hstack([traced, meshed])).save(options.output / "three.png", optimize=True)
    differ = np.abs(traced.astype(int) - meshed).sum(axis=-1) > APART
    print(f"three.js: {differ.mean():.2%} of the pixels differ from those of a mesh of {CELLS} cells along an edge")


if __name__ == "__main__":
    main()
