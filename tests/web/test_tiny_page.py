"""Tiny pages: their code, their picture against Shadertoy's text, controls, failing devices, hostile names."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from mplicits.bake.registry import TARGETS
from mplicits.model.gallery import model_path
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.model.quantize import quantized_model
from mplicits.viewer.draw.context import Context
from mplicits.web.base124 import base124
from support import needs
from support.browser import visit
from support.moving_model import moving_model
from support.page_pictures import MODEL
from support.random_model import random_model
from support.shadertoy import SHADERTOY, picture
from support.tiny_visit import COUNT, MOVES, asked, still
from support.unpacked import bytes_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser

TINY = TARGETS["tiny"]
SMALL = replace(quantized_model(MODEL), credit="somebody, CC0", front=(200.0, 15.0))
SIZE = (195, 422)
LABEL = 40
"""Rows at the top of a picture that may hold the credit."""
HOSTILE = "</title></script><script>document.documentElement.dataset.bad = 1</script><!-- ü@{{packed}}\n\x01"


def psnr(ours: NDArray[np.int16], theirs: NDArray[np.int16]) -> float:
    """Return the similarity of two pictures below the credit, decibels."""
    return float(10 * np.log10(255**2 / np.square((ours - theirs)[LABEL:].astype(float)).mean()))


def page(model: Model, folder: Path, shade: str | None = None) -> Path:
    """Write a model's tiny page without a search for fewer bits."""
    file = folder / "tiny.html"
    file.write_bytes(TINY(model, "packed" if model.inputs == "xyz" else "auto", shade=shade).encode())
    return file


@pytest.mark.parametrize("size", [0, 1, 7, 868, 869, 870, 2000])
def test_the_text_of_a_page_holds_any_bytes(size: int) -> None:
    for data in (bytes(size), b"\xff" * size, np.random.default_rng(size).bytes(size)):
        text = base124(data)
        assert bytes_of(text) == data
        assert len(text) <= 1.1508 * size + 1
        assert not set(text) & {"\0", "\r", "<"}
        assert text.isascii()


PINCH = """() => {
    const canvas = document.querySelector("canvas");
    canvas.setPointerCapture = () => {};
    for (const [kind, id, x] of [["down", 1, 70], ["down", 2, 130], ["move", 1, 90], ["move", 2, 110]]) {
        const touch = {pointerId: id, clientX: x, clientY: 200, pointerType: "touch"};
        canvas.dispatchEvent(new PointerEvent(`pointer${kind}`, touch));
    }
}"""


def test_dragging_turns_and_the_wheel_and_fingers_zoom(browser: "Browser", osmesa: Context, tmp_path: Path) -> None:
    text = SHADERTOY(SMALL, "packed", shade="phong")
    with visit(browser, page(SMALL, tmp_path, "phong"), size=SIZE, share=1, script=COUNT) as visited:
        first, mouse = still(visited), visited.page.mouse
        before = asked(visited)
        mouse.move(60, 200)
        mouse.down()
        mouse.move(110, 230, steps=3)
        mouse.up()
        visited.page.keyboard.press("ArrowRight")  # as a drag of 40 pixels to the left
        turned = still(visited, before)
        # Shadertoy's y axis points up.
        expected = picture(osmesa, text, (110 - 40, 422 - 230, 60, 422 - 200), size=SIZE)
        assert psnr(turned, expected) > 30 > psnr(first, expected)
        before = asked(visited)
        mouse.wheel(0, -200)
        near = covered(still(visited, before))
        assert near > 1.5 * covered(turned)
        before = asked(visited)
        visited.page.evaluate(PINCH)
        assert covered(still(visited, before)) < near / 1.5
        before = asked(visited)
        visited.page.set_viewport_size({"width": 300, "height": 200})
        assert still(visited, before).shape == (200, 300, 3)
        assert visited.page.evaluate("document.querySelector('canvas').width") == 300
        assert visited.console == []


def covered(drawn: NDArray[np.int16]) -> int:
    """Count the pixels of the shape, which are brighter than the background, or darker."""
    return int((np.abs(drawn - drawn[:, :1]).max(axis=2) > 30).sum())


def test_the_page_is_light_for_visitors_who_prefer_that(browser: "Browser", tmp_path: Path) -> None:
    tops = {}
    for scheme in ("light", "dark"):
        with visit(browser, page(SMALL, tmp_path), SIZE, 1, COUNT, color_scheme=scheme) as visited:
            tops[scheme] = still(visited)[-1, 0]
            color = visited.page.evaluate("getComputedStyle(document.body).color")
            assert color == {"light": "rgb(0, 0, 0)", "dark": "rgb(255, 255, 255)"}[scheme]
    assert min(tops["light"]) > 180
    assert max(tops["dark"]) < 60


def test_the_turntable_turns_until_somebody_drags(browser: "Browser", tmp_path: Path) -> None:
    with visit(
        browser, page(SMALL, tmp_path, "phong"), size=(96, 96), share=1, script=COUNT.replace("true", "false")
    ) as visited:
        visited.until(MOVES)
        visited.page.mouse.click(50, 50)
        still(visited)


def test_a_moving_model_has_its_weights_as_text(browser: "Browser", tmp_path: Path) -> None:
    file, moves = page(moving_model(), tmp_path), COUNT.replace("true", "false")
    with visit(browser, file, size=(96, 96), share=1, script=moves) as visited:
        visited.until(MOVES)
        visited.page.mouse.click(50, 50)  # which ends the turntable
        visited.page.evaluate("coarse = 0")
        visited.until(MOVES)
        assert visited.console == []
    with visit(browser, file, size=(96, 96), share=1, script=COUNT) as visited:
        first, before = still(visited), asked(visited)
        visited.page.mouse.wheel(0, 0)
        assert np.abs(still(visited, before) - first).mean() < 1, "it stands at its first moment"


NO_CONTEXT = "HTMLCanvasElement.prototype.getContext = () => null"
FAILING = {
    NO_CONTEXT: "WebGL 2 is missing",
    "delete window.DecompressionStream": "ReferenceError: DecompressionStream is not defined",
    "WebGL2RenderingContext.prototype.createShader = () => null": "the graphics driver refuses the shader",
    "WebGL2RenderingContext.prototype.linkProgram = () => {}": "the graphics driver refuses the shader",
}
"""Script that makes a device fail -> what the page says."""
LINE = """(() => {
    const range = document.createRange();
    range.selectNodeContents(document.body);
    const {top, bottom, left, right} = range.getBoundingClientRect();
    const size = parseInt(getComputedStyle(document.body).fontSize);
    return [top / innerHeight, bottom / innerHeight, left, innerWidth - right, size];
})()"""


@pytest.mark.parametrize("script", FAILING)
def test_the_page_says_why_it_draws_nothing(browser: "Browser", tmp_path: Path, script: str) -> None:
    with visit(browser, page(SMALL, tmp_path), size=(390, 844), script=script) as visited:
        visited.until("document.body.innerText.includes('cannot')")
        advice = "Try another browser or device."
        assert visited.page.inner_text("body") == f"fitted cannot be drawn: {FAILING[script]}. {advice}"
        top, bottom, left, right, size = visited.page.evaluate(LINE)
        assert 0.3 < top < bottom < 0.7
        assert min(left, right) >= 9
        assert size >= 16
        visited.page.set_viewport_size({"width": 300, "height": 200})
        visited.page.keyboard.press("ArrowRight")
        assert visited.console == []


LOSE = """
    window.canvas ??= document.querySelector("canvas");
    window.loss ??= canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
    window.hoped ??= [];
    canvas.addEventListener("webglcontextlost", ({defaultPrevented}) => hoped.push(defaultPrevented), {once: true});
    loss.loseContext();
"""
"""Loses the context, and records whether the page hopes for another."""


def test_a_lost_context_comes_back_until_it_fails_twice_in_a_row(browser: "Browser", tmp_path: Path) -> None:
    with visit(browser, page(SMALL, tmp_path, "phong"), size=SIZE, share=1, script=COUNT) as visited:
        first, tab = still(visited), visited.page
        for _ in range(2):
            before = asked(visited)
            tab.evaluate(f"() => {{{LOSE}}}")
            visited.until("document.body.innerText.includes('cannot be drawn: the graphics driver failed.')")
            tab.evaluate("loss.restoreContext()")
            assert np.abs(still(visited, before) - first).mean() < 1  # a busy device has fewer samples a pixel
        again = f'canvas.addEventListener("webglcontextrestored", () => {{{LOSE}}})'
        tab.evaluate(f"() => {{{again}; {LOSE}}}")
        visited.until("hoped.length === 3")
        tab.evaluate("loss.restoreContext()")
        visited.until("hoped.length === 4")
        assert tab.evaluate("hoped") == [True, True, True, False]
        assert "the graphics driver failed" in tab.inner_text("body")
        assert visited.console == []


def test_hostile_names_stay_text(browser: "Browser", tmp_path: Path) -> None:
    model = replace(quantized_model(random_model((8, 0), name=HOSTILE)), credit=HOSTILE)
    with visit(browser, page(model, tmp_path), size=(96, 96), share=1, script=COUNT) as visited:
        still(visited)
        assert visited.root("bad") is None
        assert "<script>document" in visited.page.title()
        assert visited.page.evaluate("document.scripts.length") == 0
        refused = "fetch('data:,').then(() => 'sent', () => 'refused')"
        assert visited.page.evaluate(refused) == "refused"


@pytest.mark.slow
@pytest.mark.usefixtures("zopfli")
@pytest.mark.parametrize(("name", "most"), [("spot-small", 10_000), ("spot", 30_000)])
def test_pages_of_the_gallery_are_tiny(name: str, most: int) -> None:
    needs.package("minify")
    assert len(TINY(load(model_path(name))).encode()) <= most
