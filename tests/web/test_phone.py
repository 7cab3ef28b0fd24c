"""Every kind of page at a phone's size, in Chromium and Firefox: the shape is whole, controls work, nothing is cut."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest
from PIL import Image

import mplicits
from mplicits.bake.registry import TARGETS
from mplicits.model.quantize import quantized_model
from mplicits.site.index import Download, Entry, index
from mplicits.web.page import poster_pixels, poster_url
from support.module_pages import module_page
from support.page_pictures import MODEL
from support.paths import ROOT
from support.phone import SHARE, SIZE, Phone, Picture, phone_chromium, phone_firefox

if TYPE_CHECKING:
    from _pytest.fixtures import FixtureRequest

pytestmark = pytest.mark.slow
WIDTH, HEIGHT = SIZE
SIDE = round(SHARE * WIDTH)
"""Pixels of a picture's width."""
MIDDLE = slice(round(SHARE * (HEIGHT - WIDTH) / 2), round(SHARE * (HEIGHT + WIDTH) / 2))
"""Rows of a square in the middle."""
SHAPE = replace(quantized_model(MODEL), texture=None, credit="somebody, CC0", front=(200.0, 15.0))
"""A shape of one light color."""
NAME = "a shape with a rather long name, such as a museum gives"
MODULE = """<meta name="viewport" content="width=device-width"><style>body { margin: 0; background: #eee }
mplicits-view { width: 100%; height: 390px }</style><h2>Text</h2>
<mplicits-view alt="A ball" camera-controls shade="phong" background="slate"></mplicits-view><p>More text</p>"""
WATCH = """document.querySelector("mplicits-view").addEventListener("poster-dismissed", ({target}) =>
    target.toBlob().then(() => target.setAttribute("data-done", "")));"""

MIDDLE_PIXEL = """(() => {
    const gl = document.querySelector("canvas").getContext("webgl2"), pixel = new Uint8Array(4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(gl.drawingBufferWidth / 2, gl.drawingBufferHeight / 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return [...pixel];
})()"""
"""The pixel in the middle of a tiny page; before the first picture, black."""


@pytest.fixture(params=["chromium", "firefox"])
def phone(request: "FixtureRequest", tmp_path: Path) -> Iterator[tuple[Path, ExitStack, str]]:
    """The folder of a page, what closes its window, and the name of the browser."""
    with ExitStack() as stack:
        yield tmp_path, stack, cast("str", request.param)


def opened(phone: tuple[Path, ExitStack, str], request: "FixtureRequest", text: str) -> Phone:
    """Open a page."""
    folder, stack, name = phone
    path = folder / "page.html"
    path.write_text(text, encoding="utf-8")
    if name == "chromium":
        return stack.enter_context(phone_chromium(request.getfixturevalue("browser"), path))
    (folder / "profile").mkdir()
    return stack.enter_context(phone_firefox(path, folder / "profile"))


def kept(picture: Picture, phone: tuple[Path, ExitStack, str], kind: str) -> Picture:
    """Write a picture to out/phone/, to look at it."""
    folder = ROOT / "out" / "phone"
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture.astype(np.uint8)).save(folder / f"{kind}-{phone[2]}.png")
    return picture


def steady(phone: Phone) -> Picture:
    """Return the picture once it changes no more."""
    before = phone.picture()
    while True:
        phone.until("new Promise((resolve) => setTimeout(() => resolve(true), 700))")
        after = phone.picture()
        if np.array_equal(before, after):
            return after
        before = after


def wrong(picture: Picture, top: int) -> float:
    """Return the share of a square from row `top` on that is shape in the picture or in the reference, not in both."""
    square = picture[top : top + SIDE]
    shape = np.abs(square - square[:, :1]).max(axis=2) > 12
    return float((shape != (poster_pixels(SHAPE, SIDE, "phong")[..., 3] > 127)).mean())


def turned(phone: Phone, before: Picture, rows: slice) -> float:
    """Drag over the shape, and return the share of the rows' pixels that change."""
    middle = round((rows.start + rows.stop) / 2 / SHARE)
    phone.drag((150, middle), (240, middle + 20))
    while np.array_equal(phone.picture(), before):  # a slow browser draws later
        phone.until("new Promise((resolve) => setTimeout(() => resolve(true), 100))")
    return float((np.abs(steady(phone) - before)[rows].max(axis=2) > 24).mean())


def test_a_page(phone: tuple[Path, ExitStack, str], request: "FixtureRequest") -> None:
    tab = opened(phone, request, TARGETS["html"](replace(SHAPE, name=NAME), "texture", shade="phong"))
    tab.until("document.documentElement.dataset.state === 'still'")
    picture = kept(steady(tab), phone, "page")
    assert wrong(picture, MIDDLE.start) < 0.02
    assert turned(tab, picture, MIDDLE) > 0.02
    side = "document.getElementById('fold').getBoundingClientRect()"
    assert tab.evaluate(f"{side}.width") >= 44
    x, y = (int(tab.evaluate(f"{side}.{axis}")) + 22 for axis in "xy")
    tab.drag((x, y), (x, y))
    tab.until("document.getElementById('panel').clientHeight > 200")
    tab.until("document.documentElement.dataset.state === 'still'")
    kept(steady(tab), phone, "panel")
    assert tab.evaluate("document.documentElement.scrollWidth") == WIDTH
    last = "document.querySelector('.buttons > :last-child').getBoundingClientRect().bottom"
    assert tab.evaluate(last) < HEIGHT


def test_a_tiny_page(phone: tuple[Path, ExitStack, str], request: "FixtureRequest") -> None:
    tab = opened(phone, request, TARGETS["tiny"](replace(SHAPE, name=NAME), "packed", shade="phong"))
    tab.until("document.querySelector('canvas')?.width === 195")
    tab.until(f"{MIDDLE_PIXEL}[0] > 100")
    picture = kept(steady(tab), phone, "tiny")
    assert wrong(picture, MIDDLE.start) < 0.02
    assert turned(tab, picture, MIDDLE) > 0.02


def test_an_element(phone: tuple[Path, ExitStack, str], request: "FixtureRequest") -> None:
    tab = opened(phone, request, module_page(mplicits.Field(SHAPE), MODULE, WATCH))
    tab.until("document.querySelector('mplicits-view[data-done]')")
    picture = kept(steady(tab), phone, "element")
    top = round(SHARE * tab.evaluate("document.querySelector('mplicits-view').getBoundingClientRect().top"))
    assert wrong(picture, top) < 0.02
    assert turned(tab, picture, slice(top, top + SIDE)) > 0.02
    assert tab.evaluate("document.documentElement.scrollWidth") == WIDTH


def test_the_index_of_a_gallery(phone: tuple[Path, ExitStack, str], request: "FixtureRequest") -> None:
    kinds = ("Page", "Tiny page", "Shadertoy", "Model")
    files = [Download(kind, f"{kind}.txt", 12_345) for kind in kinds]
    picture = poster_url(SHAPE, "phong", 200)
    tab = opened(phone, request, index(NAME, [Entry(NAME, "20x0 > 32x0", "somebody", picture, files)] * 3))
    tab.until("[...document.images].every((image) => image.complete && image.naturalWidth)")
    shown = kept(steady(tab), phone, "gallery")
    assert tab.evaluate("document.documentElement.scrollWidth") == WIDTH
    left, right, top, bottom = (
        tab.evaluate(f"document.images[0].getBoundingClientRect().{name}")
        for name in ("left", "right", "top", "bottom")
    )
    assert 0 <= left < right <= WIDTH
    assert right - left > 0.8 * WIDTH, "one column"
    rows, columns = (slice(int(SHARE * a) + 1, int(SHARE * b) - 1) for a, b in ((top, bottom), (left, right)))
    inside = shown[rows, columns]
    colors = np.abs(inside - inside[0, 0]).max(axis=2) > 24
    assert 0.15 < colors.mean() < 0.9
    assert (
        tab.evaluate(
            "Math.min(...[...document.querySelectorAll('nav a')].map((a) => a.clientHeight || a.offsetHeight))"
        )
        >= 20
    )
