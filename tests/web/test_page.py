"""The web page in Chromium, offline from a file: its pictures, and every control, by mouse, touch and keys."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.codegen.targets import glsl330, shadertoy
from mplicits.model.quantize import quantized_model
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web.document import Studio, packed
from mplicits.web.page import page_of
from support.browser import Visit, visit
from support.page_pictures import MODEL, SIDE, desktop, differ
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.fixture(scope="module")
def renderer(osmesa: Context) -> Renderer:
    return Renderer(osmesa, glsl330.bake(MODEL))


def test_the_page_displays_the_model_s_size_and_the_field_s_error(opened: Visit) -> None:
    assert opened.page.title() == "fitted"
    assert opened.page.inner_text("h1") == "fitted"
    assert f"20x0 > 32x0 · {MODEL.parameters():,} parameters" in opened.page.inner_text("header")
    assert float(opened.root("error") or "nan") < 5e-6
    opened.saved()
    opened.until("!document.getElementById('status').innerText.includes('trying')")
    time, field = opened.page.inner_text("#status").splitlines()
    assert re.fullmatch(r"[\d.]+ m?s · 128 × 128 · \d+ samples", time)
    assert re.fullmatch(r"field error \d\.\de-\d · weights as (literals|a texture)", field)


def test_the_mouse_turns_moves_zooms_and_resets_the_view(opened: Visit) -> None:
    mouse, page = opened.page.mouse, opened.page
    page.keyboard.press("r")
    opened.until("location.hash === '#az=30&el=20'")
    mouse.move(200, 300)
    mouse.down()
    mouse.move(264, 300, steps=3)
    mouse.up()
    opened.until("location.hash === '#az=12&el=20'")
    mouse.down(button="right")
    mouse.move(264, 200, steps=3)
    mouse.up(button="right")
    opened.until("location.hash.includes('at=')")
    assert [float(c) for c in opened.camera()["at"].split(",")][1] < -0.2
    mouse.wheel(0, -300 * 0.2)  # Chromium scales it by the pixels per CSS pixel
    opened.until("location.hash.includes('d=')")
    assert float(opened.camera()["d"]) == pytest.approx(Camera().away / 1.1**3, abs=1e-3)
    mouse.dblclick(200, 300)
    opened.until("location.hash === '#az=30&el=20'")


def test_keys_turn_move_and_zoom_the_view(opened: Visit) -> None:
    page = opened.page
    page.keyboard.press("r")
    page.focus("#view")
    for key in ("ArrowRight", "ArrowUp", "+", "Shift+ArrowRight"):
        page.keyboard.press(key)
    opened.until("location.hash.includes('at=')")
    camera = opened.camera()
    assert (camera["az"], camera["el"]) == ("35", "25")
    assert float(camera["d"]) == pytest.approx(0.9 * Camera().away, abs=1e-3)
    page.keyboard.press("r")
    opened.until("location.hash === '#az=30&el=20'")


def test_two_fingers_pinch_and_one_turns(opened: Visit) -> None:
    page = opened.page
    page.keyboard.press("r")
    opened.until("location.hash === '#az=30&el=20'")
    session = page.context.new_cdp_session(page)

    def touch(kind: str, *fingers: tuple[int, int]) -> None:
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(fingers)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", (150, 300), (250, 300))
    touch("touchMove", (150, 300), (250, 300))
    touch("touchMove", (100, 300), (300, 300))
    touch("touchEnd")
    opened.until("location.hash.includes('d=')")
    assert float(opened.camera()["d"]) == pytest.approx(0.5 * Camera().away, rel=0.02)
    touch("touchStart", (100, 300))
    touch("touchMove", (100, 300))
    touch("touchMove", (164, 300))
    touch("touchEnd")
    opened.until("location.hash.includes('az=12')")
    page.keyboard.press("r")


def middle(opened: Visit, selector: str, right: float = 0, down: float = 0) -> tuple[float, float]:
    """Return a point of an element at an offset from its middle, in shares of its size; CSS pixels."""
    box = opened.page.locator(selector).bounding_box()
    assert box is not None
    return box["x"] + box["width"] * (0.5 + right), box["y"] + box["height"] * (0.5 + down)


Act = Callable[[Visit], None]
"""An action of a visitor."""


def in_panel(act: Act) -> Act:
    """Acts in the panel and folds it again, so that the canvas fills the window."""

    def do(opened: Visit) -> None:
        opened.unfold()
        act(opened)
        opened.fold()

    return do


def click(selector: str) -> Act:
    return in_panel(lambda opened: opened.page.click(selector))


def press(key: str) -> Act:
    return lambda opened: opened.page.keyboard.press(key)


def light(right: float, down: float) -> Act:
    """Clicks the light ball at an offset from its middle, in shares of its radius."""
    return in_panel(lambda opened: opened.page.mouse.click(*middle(opened, "#light", right / 2, down / 2)))


LENGTH = 1.38**0.5
"""Length of the default light, (-0.5, 0.7, 0.8)."""
PAPER = (0.97, 0.965, 0.95), (0.85, 0.84, 0.81)
CONTROLS: dict[str, tuple[Act, Act, RenderOptions]] = {
    # Control -> action, its reversal, and the equivalent desktop options.
    "normals": (click("#shading label:has-text('Normals')"), press("p"), RenderOptions(shade="normal")),
    "softbox": (press("g"), press("p"), RenderOptions(shade="softbox")),
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
def test_a_control_does_what_the_desktop_s_option_does(name: str, opened: Visit, renderer: Renderer) -> None:
    do, undo, options = CONTROLS[name]
    opened.page.keyboard.press("r")
    do(opened)
    ours = opened.saved()
    undo(opened)
    assert not differ(ours, desktop(renderer, Camera(), options))
    assert differ(ours, desktop(renderer, Camera(), RenderOptions()))


def test_heat_colors_show_the_steps_of_each_ray(opened: Visit) -> None:
    opened.page.keyboard.press("x")
    picture = opened.saved()
    opened.page.keyboard.press("p")
    assert np.abs(picture[0, 0].astype(int) - (3, 3, 13)).max() <= 1, "a ray that misses makes none"
    assert picture[SIDE // 2, SIDE // 2].max() > 30


def test_the_panel_sets_iterations_and_resolution_and_can_be_folded(opened: Visit) -> None:
    page = opened.page
    opened.unfold()
    assert page.inner_text("#steps") == "20 · 5"
    page.focus("#iterations")
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    assert page.inner_text("#steps") == "40 · 10"
    for _ in range(4):
        page.keyboard.press("ArrowLeft")
    page.click("#resolution label:has-text('½')")
    opened.until("/^[\\d.]+ m?s · 33 × 64( |$)/m.test(document.getElementById('status').textContent)")
    page.click("#resolution label:has-text('Auto')")
    page.click("#fold")
    assert not page.is_visible("#panel")
    page.keyboard.press("h")
    assert page.is_visible("#panel")
    page.keyboard.press("h")


def test_the_page_fills_the_screen_and_comes_back(opened: Visit) -> None:
    opened.unfold()
    opened.page.click("#full")
    opened.until("document.fullscreenElement !== null")
    opened.page.keyboard.press("f")
    opened.until("document.fullscreenElement === null")
    opened.fold()


def test_the_page_draws_only_after_changes(opened: Visit) -> None:
    opened.still()
    draws = """() => {
        const gl = document.getElementById("view").getContext("webgl2"), draw = gl.drawArrays;
        window.draws = 0;
        gl.drawArrays = function (...values) { ++window.draws; return draw.apply(this, values); };
    }"""
    opened.until("!document.getElementById('status').textContent.includes('trying literals')")  # it draws for that
    opened.page.evaluate(draws)
    opened.page.wait_for_timeout(400)
    assert opened.page.evaluate("window.draws") == 0
    opened.page.keyboard.press("ArrowLeft")
    opened.until("window.draws > 0")
    opened.page.keyboard.press("r")


def test_the_button_copies_the_text_for_shadertoy(browser: "Browser", tmp_path: Path) -> None:
    model = quantized_model(random_model((4, 0), texture=(4, 0)))
    file = tmp_path / "page.html"
    file.write_text(packed(page_of(model, poster=False, studio=Studio())[0]).text)
    with visit(browser, file, permissions=["clipboard-read", "clipboard-write"]) as visited:
        visited.unfold()
        assert visited.page.input_value("#shading input:checked") == "softbox", "it opens so"
        visited.page.click("#copy")
        visited.page.wait_for_selector("#message:not([hidden])")
        assert visited.page.evaluate("navigator.clipboard.readText()") == shadertoy.exact(model)
        assert visited.console == []
