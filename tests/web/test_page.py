"""The html page in Chromium, offline from a file: its pictures, and every control, used as a person would use it."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mplicits.codegen.targets import glsl330, shadertoy
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web.page import standalone
from support.browser import Visit, visit
from support.page_pictures import MODEL, SIDE, desktop, differ

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.fixture(scope="module")
def renderer(osmesa: Context) -> Renderer:
    return Renderer(osmesa, glsl330.bake(MODEL))


@pytest.mark.parametrize("view", [(30, 20, None), (200, -35, 2.6), (95, 70, 4.5)])
def test_the_page_shows_the_picture_that_osmesa_draws(
    view: tuple[float, float, float | None], shown: Visit, renderer: Renderer
) -> None:
    azimuth, elevation, distance = view
    hash_ = f"#az={azimuth}&el={elevation}" + (f"&d={distance}" if distance else "")
    shown.follow(hash_)
    ours = shown.saved()
    assert ours.shape == (SIDE, SIDE, 3)
    assert not differ(ours, desktop(renderer, Camera(azimuth, elevation, distance), RenderOptions()))
    turned = desktop(renderer, Camera(azimuth + 6, elevation, distance), RenderOptions())
    assert differ(ours, turned), "the tolerance tells another view apart"


def test_the_page_opens_in_the_studio(browser: "Browser", tmp_path: Path, renderer: Renderer) -> None:
    file = tmp_path / "page.html"
    file.write_text(standalone(MODEL))
    with visit(browser, file) as visited:
        visited.still()
        visited.unfold()
        assert visited.page.input_value("#shading input:checked") == "studio"
        visited.fold()
        assert not differ(visited.saved(), desktop(renderer, Camera(), RenderOptions(shade="studio")))
        assert visited.said == []


def test_the_page_says_what_it_shows_and_how_exact_it_is(shown: Visit) -> None:
    assert shown.page.title() == "fitted"
    assert shown.page.inner_text("h1") == "fitted"
    assert f"20x0 > 32x0 · {MODEL.parameters():,} parameters" in shown.page.inner_text("header")
    assert float(shown.root("error") or "nan") < 5e-6
    shown.saved()
    time, field = shown.page.inner_text("#status").splitlines()
    assert re.fullmatch(r"[\d.]+ m?s · 128 × 128 · \d+ samples", time)
    assert re.fullmatch(r"field error \d\.\de-\d · weights as (literals|a texture)", field)


def test_the_mouse_turns_moves_zooms_and_resets_the_view(shown: Visit) -> None:
    mouse, page = shown.page.mouse, shown.page
    page.keyboard.press("r")
    shown.until("location.hash === '#az=30&el=20'")
    mouse.move(200, 300)
    mouse.down()
    mouse.move(264, 300, steps=3)
    mouse.up()
    shown.until("location.hash === '#az=12&el=20'")
    mouse.down(button="right")
    mouse.move(264, 200, steps=3)
    mouse.up(button="right")
    shown.until("location.hash.includes('at=')")
    assert [float(c) for c in shown.camera()["at"].split(",")][1] < -0.2
    mouse.wheel(0, -300 * 0.2)  # Chromium scales it by the pixels per CSS pixel
    shown.until("location.hash.includes('d=')")
    assert float(shown.camera()["d"]) == pytest.approx(Camera().away / 1.1**3, abs=1e-3)
    mouse.dblclick(200, 300)
    shown.until("location.hash === '#az=30&el=20'")


def test_keys_turn_move_and_zoom_the_view(shown: Visit) -> None:
    page = shown.page
    page.keyboard.press("r")
    page.focus("#view")
    for key in ("ArrowRight", "ArrowUp", "+", "Shift+ArrowRight"):
        page.keyboard.press(key)
    shown.until("location.hash.includes('at=')")
    camera = shown.camera()
    assert (camera["az"], camera["el"]) == ("35", "25")
    assert float(camera["d"]) == pytest.approx(0.9 * Camera().away, abs=1e-3)
    page.keyboard.press("r")
    shown.until("location.hash === '#az=30&el=20'")


def test_two_fingers_pinch_and_one_turns(shown: Visit) -> None:
    page = shown.page
    page.keyboard.press("r")
    shown.until("location.hash === '#az=30&el=20'")
    session = page.context.new_cdp_session(page)

    def touch(kind: str, *fingers: tuple[int, int]) -> None:
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(fingers)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", (150, 300), (250, 300))
    touch("touchMove", (150, 300), (250, 300))
    touch("touchMove", (100, 300), (300, 300))
    touch("touchEnd")
    shown.until("location.hash.includes('d=')")
    assert float(shown.camera()["d"]) == pytest.approx(0.5 * Camera().away, rel=0.02)
    touch("touchStart", (100, 300))
    touch("touchMove", (100, 300))
    touch("touchMove", (164, 300))
    touch("touchEnd")
    shown.until("location.hash.includes('az=12')")
    page.keyboard.press("r")


def middle(shown: Visit, selector: str, right: float = 0, down: float = 0) -> tuple[float, float]:
    """Return a point of an element, away from its middle by shares of its width and height; CSS pixels."""
    box = shown.page.locator(selector).bounding_box()
    assert box is not None
    return box["x"] + box["width"] * (0.5 + right), box["y"] + box["height"] * (0.5 + down)


Act = Callable[[Visit], None]
"""Something that a person does on the page."""


def in_panel(act: Act) -> Act:
    """Does something in the panel, which is folded again, so that the canvas fills the window as the desktop's does."""

    def do(shown: Visit) -> None:
        shown.unfold()
        act(shown)
        shown.fold()

    return do


def click(selector: str) -> Act:
    """Clicks an element of the panel."""
    return in_panel(lambda shown: shown.page.click(selector))


def press(key: str) -> Act:
    """Presses a key."""
    return lambda shown: shown.page.keyboard.press(key)


def light(right: float, down: float) -> Act:
    """Clicks the ball that sets the light, away from its middle by shares of its radius."""
    return in_panel(lambda shown: shown.page.mouse.click(*middle(shown, "#light", right / 2, down / 2)))


LENGTH = 1.38**0.5
"""Length of the default light, (-0.5, 0.7, 0.8)."""
PAPER = (0.97, 0.965, 0.95), (0.85, 0.84, 0.81)
CONTROLS: dict[str, tuple[Act, Act, RenderOptions]] = {
    # Control -> how to use it, how to undo that, and the desktop's options for the same.
    "normals": (click("#shading label:has-text('Normals')"), press("p"), RenderOptions(shade="normal")),
    "studio": (press("g"), press("p"), RenderOptions(shade="studio")),
    "depth": (press("d"), click("#shading label:has-text('Phong')"), RenderOptions(shade="depth")),
    "texture": (click("#shading label:has-text('Texture')"), press("p"), RenderOptions(shade="texture")),
    "level": (click("#level label:has-text('1')"), press("2"), RenderOptions(level=1)),
    "normal level": (
        click("#normals label:has-text('1')"),
        click("#normals label:has-text('same')"),
        RenderOptions(normal_level=1),
    ),
    "light": (light(0.5, 0), light(-0.5 / LENGTH, -0.7 / LENGTH), RenderOptions(light=(0.5, 0, 0.75**0.5))),
    "background": (
        click("#background label[title='paper']"),
        click("#background label[title='slate']"),
        RenderOptions(background=PAPER),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTROLS)
def test_a_control_does_what_the_desktop_s_option_does(name: str, shown: Visit, renderer: Renderer) -> None:
    do, undo, options = CONTROLS[name]
    shown.page.keyboard.press("r")
    do(shown)
    ours = shown.saved()
    undo(shown)
    assert not differ(ours, desktop(renderer, Camera(), options))
    assert differ(ours, desktop(renderer, Camera(), RenderOptions()))


def test_the_steps_of_each_ray_are_shown_as_heat(shown: Visit) -> None:
    shown.page.keyboard.press("x")
    picture = shown.saved()
    shown.page.keyboard.press("p")
    assert np.abs(picture[0, 0].astype(int) - (3, 3, 13)).max() <= 1, "a ray that misses makes none"
    assert picture[SIDE // 2, SIDE // 2].max() > 30


def test_the_panel_sets_iterations_and_resolution_and_can_be_folded(shown: Visit) -> None:
    page = shown.page
    shown.unfold()
    assert page.inner_text("#steps") == "20 · 5"
    page.focus("#iterations")
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    assert page.inner_text("#steps") == "40 · 10"
    for _ in range(4):
        page.keyboard.press("ArrowLeft")
    page.click("#resolution label:has-text('½')")
    shown.until("/^[\\d.]+ m?s · 33 × 64( |$)/m.test(document.getElementById('status').textContent)")
    page.click("#resolution label:has-text('Auto')")
    page.click("#fold")
    assert not page.is_visible("#panel")
    page.keyboard.press("h")
    assert page.is_visible("#panel")
    page.keyboard.press("h")


def test_the_page_fills_the_screen_and_comes_back(shown: Visit) -> None:
    shown.unfold()
    shown.page.click("#full")
    shown.until("document.fullscreenElement !== null")
    shown.page.keyboard.press("f")
    shown.until("document.fullscreenElement === null")
    shown.fold()


def test_nothing_is_drawn_while_nothing_changes(shown: Visit) -> None:
    shown.still()
    draws = """() => {
        const gl = document.getElementById("view").getContext("webgl2"), draw = gl.drawArrays;
        window.draws = 0;
        gl.drawArrays = function (...values) { ++window.draws; return draw.apply(this, values); };
    }"""
    shown.page.evaluate(draws)
    shown.page.wait_for_timeout(400)
    assert shown.page.evaluate("window.draws") == 0
    shown.page.keyboard.press("ArrowLeft")
    shown.until("window.draws > 0")
    shown.page.keyboard.press("r")


def test_the_button_copies_the_text_for_shadertoy(
    browser: "Browser", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "void mainImage() { } // <é>"
    monkeypatch.setattr(shadertoy, "standalone", lambda model, storage="auto", digits=None, shade=None: text)
    file = tmp_path / "page.html"
    file.write_text(standalone(MODEL))
    with visit(browser, file, permissions=["clipboard-read", "clipboard-write"]) as visited:
        visited.unfold()
        visited.page.click("#copy")
        visited.page.wait_for_selector("#message:not([hidden])")
        assert visited.page.evaluate("navigator.clipboard.readText()") == text
        assert visited.said == []


def test_a_phone_begins_with_the_panel_folded_and_wastes_no_width(browser: "Browser", page_file: Path) -> None:
    phone: dict[str, Any] = {"has_touch": True, "is_mobile": True, "color_scheme": "light"}
    with visit(browser, page_file, size=(390, 844), **phone) as visited:
        assert visited.root("tone") == "light"
        assert not visited.page.is_visible("#panel")
        visited.page.tap("#fold")
        assert visited.page.is_visible("#panel")
        box = visited.page.locator("#panel").bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        assert visited.page.evaluate("document.documentElement.scrollWidth") == 390


def test_the_page_is_one_file_that_asks_for_no_other(page_file: Path) -> None:
    text = page_file.read_text()
    assert "{{" not in text
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:)""", text)
    assert not re.search(r"\bimport\b|\bfetch\(|XMLHttpRequest|https?://", text.replace("important", ""))
