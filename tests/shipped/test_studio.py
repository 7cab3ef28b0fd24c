"""The studio trains each of its examples, saves it, and stands every button and condition."""

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from support.conditions import CONDITIONS, check_line, conditioned
from support.presses import press_everything
from support.references import SHARE, STILL, check_rendered
from support.stranger import Stranger
from support.studio_visit import save
from support.tabs import Tab, chromium_tab, firefox_tab, steady

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

SIZE = (480, 520)
"""CSS pixels of the window: the bar is below the picture."""
EXAMPLES, VASE = 3, 1
"""The number of examples, and the place of the one that is learned soonest."""
TRAINED = "document.getElementById('download')"
OFF = re.compile(r"off by (\d\.\de-\d) of the radius · normals by (\d+\.\d)°")


def check_trained(tab: Tab, example: int, preset: str) -> None:
    """Train an example. The page says figures, and that the shape is learned."""
    tab.until("'ready' in document.documentElement.dataset")
    tab.evaluate(f"document.querySelector('#preset input[value={preset}]').click()")
    assert tab.evaluate("document.querySelectorAll('#examples button').length") == EXAMPLES
    tab.evaluate(f"document.querySelectorAll('#examples button')[{example}].click()")
    tab.until(f"{TRAINED} && {STILL}")
    told = tab.evaluate("document.getElementById('report').textContent")
    assert OFF.search(told), told
    assert not tab.evaluate("'far' in document.documentElement.dataset"), told


@pytest.mark.parametrize("example", range(EXAMPLES))
def test_chromium(example: int, browser: "Browser", shipped: Stranger) -> None:
    """The picture is that of `mplicits render` of the saved model, which is as near to the shape as the page says."""
    with chromium_tab(browser, shipped.folder / "studio.html", SIZE, SHARE) as tab:
        check_trained(tab, example, "small")
        path = shipped.folder / f"example-{example}.safetensors"  # the stranger reads it
        save(tab.visit, "#download", path)
        area = tab.evaluate("[...['width', 'height'].map((side) => document.getElementById('view')[side])]")
        shown = steady(tab)[: area[1], : area[0]]
        check_rendered(shown, shipped, str(path), tab.evaluate("location.hash"), f"studio-{example}", "phong")
        if not example:
            press_everything(tab.visit, "#exports")
        assert tab.console() == []


def test_firefox(shipped: Stranger, tmp_path: Path) -> None:
    with firefox_tab(tmp_path, SIZE, SHARE) as tab:
        tab.open(shipped.folder / "studio.html")
        check_trained(tab, VASE, "tiny")
        assert tab.console() == []


@pytest.mark.parametrize("name", CONDITIONS)
def test_conditions(name: str, browser: "Browser", shipped: Stranger) -> None:
    """It trains, or says in one line what is missing."""
    condition = CONDITIONS[name]
    if name == "no-simd":
        condition = replace(condition, says="WebAssembly SIMD")
    with conditioned(browser, shipped.folder / "studio.html", condition, SIZE, SHARE) as tab:
        if condition.says:
            check_line(tab, condition.says)
            press_everything(tab.visit)
        else:
            check_trained(tab, VASE, "tiny")
