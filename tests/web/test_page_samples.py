"""Further samples of the page's picture: their choice is the desktop's, and the picture is good."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.viewer.draw import adaptive
from mplicits.web.bundle import script
from mplicits.web.facts import facts_json
from support.browser import visit
from support.changed_page import changed_page
from support.page_pictures import MODEL, differ, remembering

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ASK = """
window.wants = ([seen, samples, side, across]) => {
    const {pixels, counts} = wanted(Uint8Array.from(seen), samples);
    const packs = packed(pixels, across, [0.25, -0.5], side);
    return {pixels, counts: [...counts], packs: packs.map((pack) => ({...pack, places: [...pack.places]}))};
};
null;
"""
TEXTURE = remembering(MODEL, "texture")  # without literals, no further redraw
COUNT = """window.accumulated = 0;
const context = WebGL2RenderingContext.prototype, {drawArrays, viewport} = context;
let area = 0;
window.shares = new Set();
const {blendColor} = context;
context.blendColor = function (...color) {
    window.shares.add(color[3]);
    return blendColor.apply(this, color);
};
context.viewport = function (x, y, width, height) {
    area = width * height;
    return viewport.call(this, x, y, width, height);
};
context.drawArrays = function (mode, first, count) {
    if (this.isEnabled(this.BLEND)) window.accumulated += mode === this.POINTS ? count : area;
    return drawArrays.call(this, mode, first, count);
};"""
"""Counts the samples that the page adds to pictures, and keeps their weights."""


@pytest.fixture(scope="module")
def blank(browser: "Browser") -> Iterator["Page"]:
    """A page without a model that has the functions of ASK."""
    page = browser.new_page()
    page.set_content(f'<!doctype html><script type="application/json" id="facts">{facts_json({})}</script>')
    page.evaluate(script(("facts.js", "samples.js")) + ASK)
    yield page
    page.close()


@pytest.mark.parametrize(("contrast", "samples"), [(20, 16), (200, 16), (90, 8)])
def test_the_page_chooses_the_samples_that_the_desktop_chooses(contrast: int, samples: int, blank: "Page") -> None:
    random = np.random.default_rng(contrast)
    picture = np.zeros((30, 40, 4), np.float32)
    picture[..., 1] = np.where(random.random((30, 40)) < 0.01, contrast, 0) / 255
    picture[4:, :, 3] = 1
    padded = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(0, 1))
    seen = np.zeros((30, 40, 4), np.uint8)
    seen[..., 0] = np.rint(255 * np.ptp(windows, axis=(3, 4)).max(axis=2))
    seen[..., 3] = 255 * picture[..., 3]
    answer = blank.evaluate("question => window.wants(question)", [seen.ravel().tolist(), samples, 8, 40])
    counts = adaptive.sample_counts(picture, samples)
    assert counts.any()
    assert answer["pixels"] == np.flatnonzero(counts).tolist()
    assert answer["counts"] == counts[counts > 0].tolist()
    packs = answer["packs"]
    assert all(pack["width"] <= 8 and pack["height"] <= 8 for pack in packs)
    images = [np.array(pack["places"], np.float32).reshape(pack["height"], pack["width"], 2) for pack in packs]
    places = np.concatenate([adaptive.from_blocks(image, image.shape[0] * image.shape[1]) for image in images])
    inside = places[places[:, 0] >= 0]
    rows, columns = np.divmod(answer["pixels"], 40)
    np.testing.assert_allclose(inside, np.stack([columns + 0.75, rows], axis=1))


MIDWAY = [
    ("const cells = await empty", "while (count > 32 && !window.midway) await pause(1); const cells = await empty"),
    ("this.scene.cells = cells;", "this.scene.cells = cells; window.grid = cells.count;"),
    (
        "if (refining.tiles) refining.spent",
        "window.midway ||= window.turned && !refining.samples && refining.pass.tiles.length > 2;"
        "if (refining.tiles) refining.spent",
    ),
    ("performance.now() < this.restAt", "performance.now() < this.restAt || window.midway && window.grid === 32"),
]
"""Makes a page find its second grid while it draws a picture with the first."""
PATIENT = ("const PATIENCE = 15000", "const PATIENCE = 300000")


@pytest.mark.slow
def test_a_second_grid_midway_in_a_picture_does_not_show(browser: "Browser", tmp_path: Path) -> None:
    pictures = []
    for changes, grid in ((MIDWAY, 32), (MIDWAY[1:2], 128)):
        file = tmp_path / "page.html"
        file.write_text(changed_page(MODEL, [PATIENT, *changes], poster=False, shade="phong"))
        with visit(browser, file, (256, 256), 1, script=TEXTURE, hash_="#panel=0") as visited:
            visited.until(f"window.grid === {grid}")
            visited.still()
            visited.page.evaluate("window.turned = true")
            visited.page.keyboard.press("ArrowRight")
            visited.until("window.grid === 128")
            visited.still()
            pictures.append(visited.saved())
            assert visited.console == []
    assert not differ(pictures[0], pictures[1])


@pytest.mark.slow
def test_further_samples_are_drawn_along_edges(browser: "Browser", tmp_path: Path) -> None:
    pictures, drawn = {}, {}
    for way, adapts in (("along the edges", "get adapts() {"), ("everywhere", "get adapts() { return false;")):
        file = tmp_path / "page.html"
        changes = [PATIENT, ("get adapts() {", adapts)]
        file.write_text(changed_page(MODEL, changes, poster=False, shade="phong"))
        with visit(browser, file, (64, 64), 1, script=TEXTURE + COUNT, hash_="#panel=0") as visited:
            visited.still()
            pictures[way] = visited.saved() / 255.0
            drawn[way] = visited.page.evaluate("window.accumulated")
            counts = 1 / np.array(visited.page.evaluate("[...window.shares]"))
            np.testing.assert_allclose(counts, counts.round(), rtol=1e-6, err_msg="each sample weighs 1 / count")
            assert visited.page.inner_text("#status").splitlines()[0].endswith("16 samples")
            assert visited.console == []
    error = float(((pictures["along the edges"] - pictures["everywhere"]) ** 2).mean())
    assert -10 * np.log10(error) > 40
    assert drawn["along the edges"] < drawn["everywhere"] / 2.5
