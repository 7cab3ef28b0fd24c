"""Elements <mplicits-view> in a page that scrolls: whose the wheel and the fingers are."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from support.module_site import BALL, STARTED, Site, site, write_files

if TYPE_CHECKING:
    from playwright.sync_api import Browser

BODY = f"""{BALL}<meta name="viewport" content="width=device-width">
<style>body {{ margin: 0; height: 3000px; }} mplicits-view {{ width: 100%; height: 200px; }}</style>
<mplicits-view id="a" camera-controls></mplicits-view>
<mplicits-view id="greedy" camera-controls touch-action="none"></mplicits-view>"""
MIDDLE = {"a": (200, 100), "greedy": (200, 300)}
"""Pixels of the page."""


@pytest.fixture(scope="module")
def opened(browser: "Browser", tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A page with touch, at its top, whose elements are drawn."""
    files = write_files(tmp_path_factory.mktemp("files"))
    with site(browser, files, BODY, has_touch=True, is_mobile=True, device_scale_factor=0.2) as page:
        page.page.wait_for_function(STARTED)
        for view in MIDDLE:
            page.told(view, "poster-dismissed")
        yield page


def orbit(opened: Site, view: str) -> dict[str, Any]:
    """Return the camera of an element."""
    value = opened.page.evaluate("id => of(id).getCameraOrbit()", view)
    assert isinstance(value, dict)
    return value


def scrolled(opened: Site) -> float:
    """Return how far the page is scrolled once it moves no more, and scroll it to its top."""
    value = opened.page.evaluate("""async () => {
        for (let before = -1; before !== scrollY; await new Promise((done) => setTimeout(done, 300))) before = scrollY;
        const far = scrollY;
        scrollTo(0, 0);
        return far;
    }""")
    return float(value)


def test_the_wheel_scrolls_the_page_until_a_click(opened: Site) -> None:
    mouse = opened.page.mouse

    def wheel(view: str) -> tuple[bool, bool]:
        """Turn the wheel, and say whether the page scrolls, and whether the shape's distance changes."""
        mouse.move(*MIDDLE[view])
        before = orbit(opened, view)["radius"]
        mouse.wheel(0, 100)
        return scrolled(opened) > 0, orbit(opened, view)["radius"] != before

    assert wheel("a") == (True, False)
    assert wheel("greedy") == (False, True)
    mouse.click(*MIDDLE["a"])
    assert wheel("a") == (False, True)
    mouse.click(200, 390)
    assert wheel("greedy") == (False, True)
    assert wheel("a") == (True, False)
    opened.page.keyboard.down("Control")
    assert wheel("a") == (False, True)
    opened.page.keyboard.up("Control")


@pytest.mark.parametrize(
    ("view", "start", "end", "scrolls", "changes"),
    [
        ("a", [(0, 60)], [(0, -60)], True, []),
        ("a", [(-60, 0)], [(60, 0)], False, ["theta"]),
        ("a", [(0, -20), (0, 20)], [(0, -60), (0, 60)], False, ["radius"]),
        ("greedy", [(0, 60)], [(0, -60)], False, ["phi"]),
    ],
)
def test_a_vertical_swipe_scrolls_the_page(
    view: str,
    start: list[tuple[int, int]],
    end: list[tuple[int, int]],
    scrolls: bool,
    changes: list[str],
    opened: Site,
) -> None:
    """Move fingers, whose places are from the element's middle, in steps as a hand does."""
    session = opened.page.context.new_cdp_session(opened.page)
    before, steps = orbit(opened, view), 12

    def touch(kind: str, share: float) -> None:
        x, y = MIDDLE[view]
        points = [
            {"x": x + a + share * (c - a), "y": y + b + share * (d - b), "id": i}
            for i, ((a, b), (c, d)) in enumerate(zip(start, end, strict=True))
        ]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points if kind != "touchEnd" else []})

    touch("touchStart", 0)
    for step in range(1, steps + 1):
        touch("touchMove", step / steps)
        opened.page.wait_for_timeout(20)
    touch("touchEnd", 1)
    assert (scrolled(opened) > 0) == scrolls
    after = orbit(opened, view)
    assert [key for key in ("theta", "phi", "radius") if abs(after[key] - before[key]) > 0.02] == changes
