"""The page during motion on a slow device: the last good picture, reprojected, until enough pixels are drawn."""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from support.browser import Visit, visit
from support.changed_page import changed_page
from support.page_pictures import MODEL, remembering

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

SIDE = 240
SLOW = [
    ("const isSlow = this.time(kept.scale < ENOUGH ? COARSEST : ENOUGH) > motion.goal;", "const isSlow = window.slow;"),
    ("coming.spent += await painter.batch(", "if (!window.hold) coming.spent += await painter.batch("),
    (
        "if (performance.now() >= renderer.restAt) return",
        "if (!window.hold && performance.now() >= renderer.restAt) return",
    ),
    ("    put(onto = null) {", "    put(onto = null) { window.reprojected = (window.reprojected ?? 0) + 1;"),
]
"""Makes a page follow, and, while `window.hold`, neither draw nor rest."""


@pytest.fixture
def visited(browser: "Browser", tmp_path: Path) -> Iterator[Visit]:
    """A page with its picture drawn."""
    file = tmp_path / "page.html"
    file.write_text(changed_page(MODEL, SLOW, poster=False, shade="texture"))
    with visit(browser, file, (SIDE, SIDE), 1, script=remembering(MODEL, "texture"), hash_="#panel=0") as page:
        page.still()
        yield page
        errors = [line for line in page.console if "ReadPixels" not in line]  # a screenshot reads the canvas
        assert errors == []


def shot(visited: Visit) -> np.ndarray:
    """Return what the canvas shows, (SIDE, SIDE, 3)."""
    return np.asarray(Image.open(io.BytesIO(visited.page.screenshot())).convert("RGB"), float)


def test_a_turned_picture_is_reprojected_until_another_is_drawn(visited: Visit) -> None:
    before = shot(visited)
    visited.page.evaluate("window.slow = window.hold = true")
    visited.page.keyboard.press("ArrowLeft")
    visited.page.keyboard.press("ArrowLeft")
    drawn = visited.page.evaluate("window.reprojected ?? 0")
    visited.until(f"window.reprojected > {drawn + 2}")
    during = shot(visited)
    visited.page.evaluate("window.hold = false")
    visited.still()
    after = shot(visited)
    mosaic = after.reshape(SIDE // 16, 16, SIDE // 16, 16, 3).mean(axis=(1, 3)).repeat(16, axis=0).repeat(16, axis=1)
    middle = np.s_[SIDE // 3 : 2 * SIDE // 3, SIDE // 3 : 2 * SIDE // 3]
    errors = [np.abs(picture - after)[middle].mean() for picture in (before, during)]
    assert errors[1] < 0.75 * errors[0], errors
    assert np.abs(during - after).mean() < 0.75 * np.abs(mosaic - after).mean()


def test_a_fast_device_draws_every_picture_of_a_motion(visited: Visit) -> None:
    visited.page.keyboard.press("ArrowLeft")  # from here on, the page is not still
    visited.still()
    assert visited.page.evaluate("window.reprojected ?? null") is None
