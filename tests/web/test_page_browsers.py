"""Pages of all sizes of models in Chromium, whose software GL is the strictest, and of one model in Firefox."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.model import gallery
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.web.page import standalone
from support.browser import visit
from support.firefox import firefox
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

MODELS = [*gallery.names(), "paper"]
"""The gallery's models, and a model with the sizes of the preset "paper"."""
STATE = "document.documentElement.dataset"


def model_of(name: str) -> Model:
    if name != "paper":
        return load(gallery.FOLDER / f"{name}{gallery.SUFFIX}")
    return random_model((64, 2), (128, 2), (256, 2), texture=(64, 2), name=name)


@pytest.mark.parametrize("name", MODELS)
def test_chromium_draws_every_size_of_model(name: str, browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(standalone(model_of(name), storage="texture"))
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
            visited.until(f"{STATE}.drawn === '' && {STATE}.error")
            remembered = visited.page.evaluate("key => localStorage.getItem(key)", f"mplicits {model.sha256()}")
            assert (remembered is not None) == tried
            assert (visited.message(), visited.console) == ("", [])


def test_firefox_draws_a_model_of_the_gallery(xvfb: dict[str, str], tmp_path: Path) -> None:
    file, profile = tmp_path / "page.html", tmp_path / "profile"
    file.write_text(standalone(model_of("spot-small"), storage="texture"))
    profile.mkdir()
    with firefox(profile, xvfb) as browser:
        browser.ask("WebDriver:SetWindowRect", {"width": 450, "height": 250})
        browser.load(file.as_uri())
        browser.until(f"{STATE}.state === 'still'")
        assert float(browser.evaluate(f"{STATE}.error")) < 5e-6
        assert browser.evaluate("document.getElementById('message').hidden")
