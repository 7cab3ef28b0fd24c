"""Every page of the gallery in Chromium and Firefox: its first picture, the same after a drag, and all its buttons."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.model import gallery
from mplicits.site.write import INDEX, TEXTS
from mplicits.viewer.draw.context import Context
from support.presses import press_everything
from support.references import SHARE, SIZE, check_page, check_tiny
from support.stranger import Stranger
from support.tabs import FirefoxTab, chromium_tab, firefox_tab

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

MADE = [(name, target, suffix) for name in gallery.names() for _, target, suffix in TEXTS if suffix.endswith(".html")]
IDS = [f"{name}-{target}" for name, target, _ in MADE]


@pytest.fixture(scope="module")
def fox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FirefoxTab]:
    with firefox_tab(tmp_path_factory.mktemp("firefox"), SIZE, SHARE) as tab:
        yield tab


def page_of(shipped: Stranger, name: str, suffix: str) -> Path:
    """Return the path of a page of the gallery. Skips the test where the gallery has none for this model."""
    path = shipped.folder / "site" / f"{name}{suffix}"
    if not path.exists() and f"{name}{suffix}" not in (shipped.folder / "site" / INDEX).read_text(encoding="utf-8"):
        pytest.skip("the model has no such page")
    return path


@pytest.mark.parametrize(("name", "target", "suffix"), MADE, ids=IDS)
def test_chromium(name: str, target: str, suffix: str, browser: "Browser", osmesa: Context, shipped: Stranger) -> None:
    with chromium_tab(browser, page_of(shipped, name, suffix), SIZE, SHARE) as tab:
        if target == "tiny":
            check_tiny(tab, shipped, name, osmesa)
        else:
            check_page(tab, shipped, name)
            press_everything(tab.visit)
        assert tab.console() == []


@pytest.mark.parametrize(("name", "target", "suffix"), MADE, ids=IDS)
def test_firefox(name: str, target: str, suffix: str, fox: FirefoxTab, osmesa: Context, shipped: Stranger) -> None:
    fox.open(page_of(shipped, name, suffix))
    if target == "tiny":
        check_tiny(fox, shipped, name, osmesa)
    else:
        check_page(fox, shipped, name)
    assert fox.console() == []
