"""The studio for keyboards, screen readers and phones."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from mplicits.model.model_file import load
from support.browser import PATIENCE, Visit, visit
from support.studio_visit import ball, ready, save, write_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser

BAD = {
    "bad.obj": (b"v 1 2", "bad.obj: line 1: a vertex needs three numbers"),
    "cloud.xyz": (
        b"1 2 3",
        "cloud.xyz: a point cloud without normals; train it with: mplicits train cloud.xyz",
    ),
    "point.obj": (b"v 1 1 1\nf 1 1 1", "point.obj: all vertices are at one place, or too far apart"),
}
"""Name of a file -> its content, and what the page says."""
PHONE: dict[str, Any] = {"size": (390, 844), "share": 0.1, "has_touch": True, "is_mobile": True}
SMALL_TARGETS = """() => [...document.querySelectorAll("button, summary, fieldset label, #more input")]
    .filter((target) => target.checkVisibility() && !target.closest("#message"))
    .filter((target) => Math.min(target.offsetHeight, target.offsetWidth) < 40)
    .map((target) => target.id || target.textContent)"""
OUTSIDE = """() => [...document.querySelectorAll("#training *, #welcome *")]
    .filter((part) => part.checkVisibility() && !part.closest("#exports, .unseen"))
    .filter((part) => {
        const {left, right, top, bottom} = part.getBoundingClientRect();
        return left < 0 || right > innerWidth + 0.5 || top < 0 || bottom > innerHeight + 0.5;
    })
    .map((part) => part.id || part.textContent)"""
FOCUSED = """() => {
    const {activeElement: at} = document, face = at.nextElementSibling ?? at;
    const ring = [at, face].some((one) => getComputedStyle(one).outlineStyle !== "none");
    return [at.id || at.value || at.textContent, ring];
}"""


def paused(visited: Visit) -> str:
    """Wait until the report stays the same for a second. Returns it."""
    end = time.monotonic() + PATIENCE / 1000
    while time.monotonic() < end:
        report = visited.page.inner_text("#report")
        visited.page.wait_for_timeout(1000)
        if visited.page.inner_text("#report") == report:
            return report
    pytest.fail("the training does not pause")


@pytest.fixture(scope="module", params=["dark", "light"])
def opened(
    request: pytest.FixtureRequest, browser: "Browser", tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Visit]:
    """The page on a phone."""
    file = write_page(tmp_path_factory.mktemp("studio") / "studio.html", 100_000)
    with visit(browser, file, **PHONE, color_scheme=request.param) as visited:
        ready(visited)
        yield visited
        assert visited.console == []


@pytest.mark.slow
def test_every_state_is_accessible_and_fits_a_phone(opened: Visit, tmp_path: Path) -> None:
    """From files that are no shapes, over a pause, to the model of a training that was stopped."""
    page = opened.page
    assert page.inner_text("h1:visible") == "Open a mesh or a point cloud"
    assert page.evaluate(
        "document.getElementById('welcome').scrollHeight <= document.getElementById('welcome').clientHeight"
    )
    for name, (data, message) in BAD.items():
        opened.drop(data, name)
        opened.until(f"document.querySelector('#message p').textContent === {message!r}")
        assert page.is_visible("#choose")
    page.click("#more summary")
    assert (opened.violations(), page.evaluate(SMALL_TARGETS), page.evaluate(OUTSIDE)) == ([], [], [])
    page.keyboard.press("Escape")
    assert page.is_hidden("#message")
    assert page.is_hidden("#more input")
    opened.drop(ball(), "a ball with a name that is too long for one line of a phone.stl")
    page.wait_for_selector("#stop")
    opened.until("document.getElementById('trained').value > 0")
    assert (opened.violations(), page.evaluate(SMALL_TARGETS), page.evaluate(OUTSIDE)) == ([], [], [])
    height = page.evaluate("document.getElementById('training').offsetHeight")
    page.click("#pause")
    before = paused(opened)
    assert page.evaluate("document.getElementById('training').offsetHeight") == height
    assert page.inner_text("#ended") == ""
    page.click("text=Go on")
    opened.until(f"document.getElementById('report').textContent !== {before!r}")
    page.click("#stop")
    page.wait_for_selector("#download")
    save(opened, "#download", tmp_path / "m.safetensors")
    assert len(load(tmp_path / "m.safetensors").levels) == 1
    assert "off by" in page.inner_text("#ended")
    assert page.evaluate("document.getElementById('stage').offsetHeight") > 422
    assert (opened.violations(), page.evaluate(SMALL_TARGETS), page.evaluate(OUTSIDE)) == ([], [], [])
    page.click("#fold")
    assert page.is_hidden("#exports")
    assert page.evaluate("document.getElementById('stage').offsetHeight") > 200


@pytest.mark.slow
def test_the_keyboard_reaches_everything(browser: "Browser", tmp_path: Path) -> None:
    with visit(browser, write_page(tmp_path / "studio.html", 20), size=(1280, 800), share=0.05) as visited:
        ready(visited)
        assert follow_tab(visited, "More") == ["choose", "Rope knot", "Fluted vase", "Gear", "base", "More"]
        visited.page.focus("[data-example='2']")
        visited.page.keyboard.press("Space")
        visited.page.wait_for_selector("#download")
        visited.page.focus("#view")
        order = follow_tab(visited, "save-webm")
        view, settings, saves = (
            "field up front",
            "longer base More again",  # 20 steps learn no shape: "Train longer" comes first
            "download save-page save-text copy-text save-webm",
        )
        wanted = f"fold another {view} {settings} {saves}".split()
        assert [name for name in order if name in wanted] == wanted, order
        assert visited.console == []


def follow_tab(visited: Visit, last: str) -> list[str]:
    """Return what Tab reaches, up to `last`, or to the end."""
    names: list[str] = []
    for _ in range(60):
        visited.page.keyboard.press("Tab")
        name, ring = visited.page.evaluate(FOCUSED)
        if name in names[:1]:
            break
        assert ring, name
        names.append(name)
        if name == last:
            break
    return names
