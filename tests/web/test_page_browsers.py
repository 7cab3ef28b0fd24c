"""Pages of large models in Chromium, whose software GL is the strictest."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.web.page import standalone
from support.browser import visit
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

STATE = "document.documentElement.dataset"


def test_chromium_draws_the_sizes_of_the_paper(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(standalone(random_model((64, 2), (128, 2), (256, 2), texture=(64, 2)), storage="texture"))
    with visit(browser, file, share=0.05) as visited:
        visited.until(f"{STATE}.drawn === '' && {STATE}.error")
        assert float(visited.root("error") or "nan") < 5e-6
        assert visited.root("state") in ("drawing", "still")
        assert (visited.message(), visited.console) == ("", [])


def test_the_page_does_not_try_literals_that_overflow_swiftshader_s_stack(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    for shapes, tried in ((((64, 1), (64, 2), (64, 2)), False), (((4, 0), (8, 0)), True)):
        model = random_model(*shapes)
        file.write_text(standalone(model))
        with visit(browser, file, share=0.05) as visited:
            visited.still()  # the page tries literals after that
            visited.until("localStorage.length" if tried else f"{STATE}.error")
            remembered = visited.page.evaluate("key => localStorage.getItem(key)", f"mplicits {model.sha256()}")
            assert (remembered is not None) == tried
            assert (visited.message(), visited.console) == ("", [])
