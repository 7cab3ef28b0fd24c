"""Every page of the gallery in Chromium and Firefox: its first picture, the same after a drag, and all its buttons."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.model import gallery
from mplicits.site.write import INDEX, TEXTS
from mplicits.viewer.draw.context import Context
from support.conditions import PHONE
from support.presses import press_everything
from support.references import SHARE, SIZE, check_page, check_tiny
from support.stranger import Stranger
from support.tabs import FirefoxTab, Tab, chromium_tab, firefox_tab

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

PAGES = [suffix for _, _, suffix in TEXTS if suffix.endswith(".html")]
"""Endings of the pages that the gallery has of a model."""
MADE = [(name, suffix) for name in gallery.names() for suffix in PAGES]
IDS = [f"{name}{suffix}" for name, suffix in MADE]
SMALL = "spot-small"


@pytest.fixture(scope="module")
def fox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FirefoxTab]:
    with firefox_tab(tmp_path_factory.mktemp("firefox"), SIZE, SHARE) as tab:
        yield tab


def page_of(shipped: Stranger, name: str, suffix: str) -> Path:
    """Return the path of a page of the gallery. Skips the test where the gallery has none for this model."""
    path = shipped.folder / "site" / f"{name}{suffix}"
    if not path.exists() and path.name not in (shipped.folder / "site" / INDEX).read_text(encoding="utf-8"):
        pytest.skip("the model has no such page")
    return path


def check(tab: Tab, shipped: Stranger, name: str, suffix: str, osmesa: Context) -> None:
    """Compare an open page with its reference, before and after a drag."""
    if suffix == ".tiny.html":
        check_tiny(tab, shipped, name, osmesa)
    else:
        check_page(tab, shipped, name)


@pytest.fixture(scope="module")
def pressed() -> set[str]:
    """The names of the controls that were pressed on some page."""
    return set()


@pytest.mark.parametrize(("name", "suffix"), MADE, ids=IDS)
def test_chromium(
    name: str, suffix: str, browser: "Browser", osmesa: Context, shipped: Stranger, pressed: set[str]
) -> None:
    with chromium_tab(browser, page_of(shipped, name, suffix), SIZE, SHARE) as tab:
        check(tab, shipped, name, suffix, osmesa)
        press_everything(tab.visit, pressed=pressed)
        assert tab.console() == []


@pytest.mark.parametrize(("name", "suffix"), MADE, ids=IDS)
def test_firefox(name: str, suffix: str, fox: FirefoxTab, osmesa: Context, shipped: Stranger) -> None:
    fox.open(page_of(shipped, name, suffix))
    check(fox, shipped, name, suffix, osmesa)
    assert fox.console() == []


@pytest.mark.parametrize("suffix", PAGES)
def test_firefox_of_a_phone_s_size(suffix: str, fox: FirefoxTab, osmesa: Context, shipped: Stranger) -> None:
    fox.size = PHONE
    fox.open(page_of(shipped, SMALL, suffix))
    check(fox, shipped, SMALL, suffix, osmesa)
    assert fox.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
    assert fox.console() == []
    fox.size = SIZE
