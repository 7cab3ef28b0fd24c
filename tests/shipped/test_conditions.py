"""A page and a tiny page in each bad condition: it draws, or one readable line says what is missing; nothing breaks."""

from typing import TYPE_CHECKING

import pytest

from mplicits.viewer.draw.context import Context
from support.conditions import CONDITIONS, check_line, conditioned
from support.presses import press_everything
from support.references import DRAG, SHARE, SIZE, check_page, check_tiny
from support.stranger import Stranger

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

MODEL = "spot-small"
FINGER = 44
"""Least width of a button for a finger, CSS pixels."""


@pytest.mark.parametrize("name", CONDITIONS)
def test_a_page(name: str, browser: "Browser", shipped: Stranger) -> None:
    path, condition = shipped.folder / "site" / f"{MODEL}.html", CONDITIONS[name]
    with conditioned(browser, path, condition, SIZE, SHARE) as tab:
        if condition.says:
            check_line(tab, condition.says)
            tab.drag(*DRAG)
        else:
            check_page(tab, shipped, MODEL)
        if name == "phone":
            assert tab.evaluate("document.getElementById('fold').getBoundingClientRect().width") >= FINGER
        press_everything(tab.visit)


@pytest.mark.parametrize("name", CONDITIONS)
def test_a_tiny_page(name: str, browser: "Browser", shipped: Stranger, osmesa: Context) -> None:
    path, condition = shipped.folder / "site" / f"{MODEL}.tiny.html", CONDITIONS[name]
    with conditioned(browser, path, condition, SIZE, SHARE) as tab:
        if condition.says:
            check_line(tab, condition.says)
            tab.drag(*DRAG)
        else:
            check_tiny(tab, shipped, MODEL, osmesa)
