"""The page with other models: dropped ones, valid and broken, and one whose name is code."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets import glsl330
from mplicits.field.rounding import in_float16
from mplicits.model.model import Layer, Model
from mplicits.model.model_file import save, to_bytes
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.web.document import whole
from mplicits.web.page import page_of
from support.broken_models import FILES, described
from support.browser import Visit, visit
from support.fitted_model import fitted_model
from support.page_pictures import MODEL, desktop, differ
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

HOSTILE = "</script><script>alert(1)</script>"
"""A model's name that would run, were it not escaped."""
SCENE = described(scene={"parts": []})(FILES["plain"])
pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (to_bytes(fitted_model((4, 4)))[:-100], "the file is cut short or damaged"),
        (b"\x89PNG\r\n\x1a\n" * 40, "a PNG picture, which this page does not open"),
        (SCENE, "needs a separate page"),
    ],
)
def test_a_broken_dropped_model_gets_a_one_line_message_and_the_old_model_stays(
    data: bytes, expected: str, opened: Visit
) -> None:
    opened.drop(data, "other.safetensors")
    opened.page.wait_for_selector("#message:not([hidden])")
    line = opened.message()
    assert line.startswith("other.safetensors: ")
    assert expected in line
    assert "\n" not in line
    assert opened.page.inner_text("h1") == "fitted"
    opened.page.click("#message button")
    assert opened.message() == ""


def test_the_page_shows_a_dropped_or_opened_model(
    browser: "Browser", page_file: Path, osmesa: Context, tmp_path: Path
) -> None:
    model = fitted_model((20, 24))
    hidden, last = model.levels[1].network
    small = Layer(last.weight * np.float32(0.02), last.bias * np.float32(0.02))
    levels = (*model.levels, replace(model.levels[1], network=(hidden, small)))
    three = Model(HOSTILE, levels, None, front=(75.0, -10.0), credit=HOSTILE)
    with visit(browser, page_file, size=(640, 640)) as visited:
        visited.drop(to_bytes(three), "other.safetensors")
        visited.until("document.title.includes('alert')")
        visited.still()
        assert visited.page.inner_text("h1") == HOSTILE
        visited.unfold()
        assert visited.page.inner_text("#shapes").endswith(f" parameters · {HOSTILE}")
        assert visited.page.inner_text("#level") == "Level\n1\n2\n3"
        assert "Texture" not in visited.page.inner_text("#shading")
        visited.fold()
        assert visited.root("storage") == "texture"
        assert float(visited.root("error") or "nan") < 1e-5
        theirs = desktop(Renderer(osmesa, glsl330.bake(three)), Camera(75, -10), RenderOptions())
        assert not differ(visited.saved(), theirs)
        save(MODEL, tmp_path / "chosen.safetensors")
        visited.page.set_input_files("#file", tmp_path / "chosen.safetensors")
        visited.until("document.title === 'fitted'")
        visited.still()
        assert visited.console == []


def test_a_name_with_html_appears_as_text(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "hostile.html"
    page, _ = page_of(replace(random_model((4, 0), name=HOSTILE), credit=HOSTILE, front=(-60, 5)))
    file.write_text(whole(page))
    with visit(browser, file) as visited:
        visited.until("document.documentElement.dataset.storage")
        assert (visited.page.title(), visited.page.inner_text("h1")) == (HOSTILE, HOSTILE)
        assert visited.page.inner_text("#shapes").endswith(HOSTILE)
        visited.page.keyboard.press("r")
        visited.until("location.hash === '#az=-60&el=5'")
        count = len(page.shaders) + 4  # before the first paint, facts, weights, and the page's
        assert visited.page.locator("script").count() == file.read_text().count("<script") == count
        assert visited.console == []


def test_float16_weights_arrive_exactly(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "half.html"
    file.write_text(TARGETS["html"](in_float16(MODEL), storage="texture"))
    with visit(browser, file) as visited:
        visited.until("document.documentElement.dataset.error")
        assert float(visited.root("error") or "nan") < 5e-6
        assert visited.console == []
