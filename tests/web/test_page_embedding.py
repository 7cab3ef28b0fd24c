"""The page embedded in another page: the URL's hash hides the panel, turns the shape and sets the background."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.codegen.targets.orbit import AZIMUTH
from mplicits.web.page import standalone
from support.browser import visit
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

HASH = "panel=0&turntable=20&background=cfe0f0"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("embedding") / "page.html"
    path.write_text(standalone(random_model((4, 0)), poster=False, shade="phong"), encoding="utf-8")
    return path


def test_the_hash_hides_the_panel_turns_the_shape_and_sets_the_background(browser: "Browser", page: Path) -> None:
    with visit(browser, page, size=(1000, 400), share=0.1, hash_="#" + HASH) as visited:
        visited.until("'drawn' in document.documentElement.dataset")
        for part in ("#panel", "#fold", "#status", "#name"):
            assert not visited.page.is_visible(part), part
        assert visited.root("tone") == "light"
        visited.page.evaluate("async () => { for (let i = 0; i < 10; i++) await new Promise(requestAnimationFrame); }")
        visited.page.keyboard.press("ArrowUp")
        visited.until("location.hash.includes('az=')")
        camera = visited.camera()
        assert (camera["panel"], camera["turntable"], camera["background"]) == ("0", "20", "cfe0f0")
        assert 0.1 < (float(camera["az"]) - AZIMUTH) % 360 < 350, "it has turned"
        visited.still()
        picture = visited.saved()
        assert picture.shape[1] == 100, "the canvas fills the window"
        np.testing.assert_allclose(picture[0, 0], [0xCF, 0xE0, 0xF0], atol=2)
        assert visited.console == []


def test_invalid_values_in_the_hash_change_nothing(browser: "Browser", page: Path) -> None:
    with visit(browser, page, size=(1000, 400), share=0.1, hash_="#turntable=x&background=toString") as visited:
        visited.until("'ready' in document.documentElement.dataset")
        assert visited.page.is_visible("#panel")
        assert visited.root("tone") == "dark"
        visited.page.keyboard.press("ArrowUp")
        visited.until("location.hash.includes('az=')")
        assert float(visited.camera()["az"]) == pytest.approx(AZIMUTH)
        assert visited.console == []
