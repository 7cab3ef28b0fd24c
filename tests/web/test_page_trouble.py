"""The page on failing devices, and its memory of a device between visits."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.bake.registry import TARGETS
from mplicits.model.model_file import save
from support.browser import held_compilers, visit
from support.changed_page import changed_page
from support.page_pictures import MODEL, differ, remembering
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow


def test_the_picture_comes_back_with_a_lost_context(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, hash_="#az=100&el=-10") as visited:
        visited.still()
        before = visited.saved()
        visited.lose_context()
        visited.page.wait_for_selector("#message:not([hidden])")
        assert visited.message().startswith("The graphics driver was reset.")
        visited.restore_context()
        visited.page.wait_for_selector("#message", state="hidden")
        visited.still()
        assert not differ(visited.saved(), before)
        assert visited.console == []


def test_a_lost_context_is_reported_and_may_come_back_late(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(changed_page(MODEL, [("const WAIT = 12000;", "const WAIT = 300;")], shade="phong"))
    with visit(browser, file) as visited:
        visited.still()
        visited.lose_context()
        visited.until("document.documentElement.dataset.state === 'failed'")
        assert "did not come back. Now you see the picture that travels in the page. Reload" in visited.message()
        assert visited.page.is_visible("#poster")
        assert visited.page.evaluate("getComputedStyle(document.getElementById('view')).opacity") == "0"
        visited.restore_context()
        visited.still()
        assert (visited.message(), visited.console) == ("", [])


FATAL = """window.losses = 0;
let levels = 0;
const context = WebGL2RenderingContext.prototype, {shaderSource, drawArrays} = context;
context.shaderSource = function (shader, text) {
    levels = Number(text.match(/const int LEVELS = (\\d+);/)?.[1] ?? levels);
    return shaderSource.call(this, shader, text);
};
context.drawArrays = function (...numbers) {
    drawArrays.apply(this, numbers);
    if (levels <= %d || this.isContextLost()) return;
    const extension = this.getExtension("WEBGL_lose_context");
    const restore = () => setTimeout(() => extension.restoreContext());
    this.canvas.addEventListener("webglcontextlost", restore, {once: true});
    extension.loseContext();
    ++window.losses;
};"""
"""The driver fails at each draw of a model with more than %d levels, and comes back."""


def test_a_model_that_kills_the_driver_comes_back_with_fewer_levels(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(TARGETS["html"](random_model((4, 0), (4, 0), (4, 0))))
    expected = "The graphics driver failed at the 3 levels of this model. Here are the first 2."
    with visit(browser, file, script=FATAL % 2) as visited:
        visited.still()
        visited.unfold()
        assert visited.message() == expected
        assert visited.page.inner_text("#level") == "Level\n1\n2"
        assert "4x0 > 4x0 · " in visited.page.inner_text("header")
        assert float(visited.root("error") or "nan") < 1e-5
        assert visited.page.evaluate("window.losses") == 1
        visited.page.reload()
        visited.still()
        assert visited.message() == expected
        assert visited.page.evaluate("window.losses") == 0, "the page does not try the fatal levels again"
        save(random_model((4, 0), (4, 0), name="other"), tmp_path / "other.safetensors")
        visited.page.set_input_files("#file", tmp_path / "other.safetensors")
        visited.until("document.title === 'other'")
        visited.still()
        assert (visited.message(), visited.console) == ("", [])


def test_a_model_that_kills_the_driver_at_its_first_level_leaves_the_poster(browser: "Browser", tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(TARGETS["html"](random_model((4, 0), (4, 0), (4, 0))))
    with visit(browser, file, script=FATAL % 0) as visited:
        visited.until("document.documentElement.dataset.state === 'failed'")
        assert visited.message().startswith("The graphics driver fails at this model, even at its first level alone.")
        assert visited.page.is_visible("#poster")
        assert visited.root("drawn") is None
        assert visited.page.evaluate("window.losses") == 3


LISTEN = """() => {
    const line = document.querySelector("#message p");
    window.said = [];
    new MutationObserver(() => window.said.push(line.textContent)).observe(line, {childList: true});
}"""
"""Records each message: one may pass between two looks."""


def test_the_page_survives_the_death_of_the_graphics_process(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file) as visited:
        visited.still()
        visited.page.evaluate(LISTEN)
        browser.new_browser_cdp_session().send("Browser.crashGpuProcess")
        visited.until("window.said.length > 0")
        assert visited.page.evaluate("window.said[0]").startswith("The graphics driver was reset.")
        visited.page.wait_for_selector("#message", state="hidden")
        visited.still()


def test_the_faster_variant_is_kept_and_remembered(browser: "Browser", page_file: Path) -> None:
    key = f"mplicits {MODEL.sha256()}"
    with visit(browser, page_file) as visited:
        visited.until(f"['literal', 'texture'].includes(localStorage.getItem('{key}'))")
        faster = visited.page.evaluate("key => localStorage.getItem(key)", key)
        visited.until(f"document.documentElement.dataset.storage === '{faster}'")
        assert visited.console == []
    for remembered, expected in (("texture", "texture"), ("trying", "texture"), ("literal", "literal")):
        with visit(browser, page_file, script=remembering(MODEL, remembered)) as visited:
            if expected == "literal":
                visited.until("document.documentElement.dataset.storage === 'literal'")
            visited.still()
            assert visited.root("storage") == expected


def test_opening_another_model_while_the_literals_compile_does_not_count_as_their_failure(
    browser: "Browser", page_file: Path, tmp_path: Path
) -> None:
    key = f"mplicits {MODEL.sha256()}"
    save(random_model((4, 0), name="other"), tmp_path / "other.safetensors")
    trial = f"localStorage.getItem('{key}') === 'trying'"
    with visit(browser, page_file, script=held_compilers(trial)) as visited:
        visited.until(trial)
        visited.page.set_input_files("#file", tmp_path / "other.safetensors")
        visited.until("document.title === 'other'")
        assert visited.page.evaluate("key => localStorage.getItem(key)", key) is None
        visited.still()
        assert visited.console == []


SMALL_TEXTURES = """const ask = WebGL2RenderingContext.prototype.getParameter;
WebGL2RenderingContext.prototype.getParameter = function (name) {
    return name === this.MAX_TEXTURE_SIZE ? 512 : ask.call(this, name);
};"""


NOTHING = "WebGL2RenderingContext.prototype.create%s = () => null;"


@pytest.mark.parametrize(
    ("init", "replaced", "expected"),
    [
        (SMALL_TEXTURES, None, "this device's largest side is 512"),
        ("", (" = trace_with_normal(", " = nothing("), "This device's compiler refuses the shader: ERROR: 0:"),
        *((NOTHING % kind, None, "The graphics driver is out of memory") for kind in ("Shader", "Program", "Texture")),
    ],
)
def test_one_message_names_the_limit_of_the_device(
    init: str, replaced: tuple[str, str] | None, expected: str, browser: "Browser", tmp_path: Path
) -> None:
    file = tmp_path / "page.html"
    file.write_text(changed_page(MODEL, [replaced] if replaced else [], shade="phong"))
    with visit(browser, file, script=init) as visited:
        visited.page.wait_for_selector("#message:not([hidden])")
        for key in ("s", "1", "p", "x", "r", "h", " ", "+", "ArrowLeft", "Escape"):
            visited.page.keyboard.press(key)
        for selector in ("#fold", "#panel", "#view"):
            assert not visited.page.is_visible(selector)
        visited.drop(b"no mesh", "photo.jpg")
        assert expected in visited.message() or visited.message().startswith("photo.jpg: ")
        assert visited.page.is_visible("#poster")
        assert visited.root("state") == "failed"
        assert visited.console == []


def test_a_context_lost_again_and_again_leaves_the_poster(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file) as visited:
        visited.still()
        for _ in range(5):
            visited.lose_context()
            visited.restore_context()
            visited.still()
        assert visited.message() == ""
        visited.lose_context()
        visited.restore_context()
        assert visited.message().startswith("The graphics driver was reset again and again. Now you see")
        assert visited.page.is_visible("#poster")
        assert (visited.root("state"), visited.console) == ("failed", [])


def test_a_device_without_float_targets_draws_the_same_picture(browser: "Browser", page_file: Path) -> None:
    init = """const extension = WebGL2RenderingContext.prototype.getExtension;
    WebGL2RenderingContext.prototype.getExtension = function (name) {
        return /color_buffer/.test(name) ? null : extension.call(this, name);
    };"""
    with visit(browser, page_file) as usual, visit(browser, page_file, script=init) as visited:
        usual.still()
        visited.still()
        assert "field error not measurable here" in visited.page.inner_text("#status")
        difference = np.abs(visited.saved().astype(int) - usual.saved())
        assert (difference.max(axis=-1) > 24).mean() < 0.02
        assert visited.console == []
