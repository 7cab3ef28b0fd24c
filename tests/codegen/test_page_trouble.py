"""The html page where the device fails it, and what it remembers of a device from visit to visit."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits.model.model import save
from support.browser import visit
from support.page_pictures import MODEL, differ
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow


def test_the_picture_comes_back_with_a_lost_context(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, hash_="#az=100&el=-10") as visited:
        visited.still()
        before = visited.saved()
        visited.page.evaluate("""() => {
            window.extension = document.getElementById("view").getContext("webgl2").getExtension("WEBGL_lose_context");
            window.extension.loseContext();
        }""")
        visited.page.wait_for_selector("#message:not([hidden])")
        assert visited.message().startswith("The graphics driver was reset.")
        visited.page.evaluate("window.extension.restoreContext()")
        visited.page.wait_for_selector("#message", state="hidden")
        visited.still()
        assert not differ(visited.saved(), before)
        assert visited.said == []


def test_the_faster_variant_is_kept_and_remembered(browser: "Browser", page_file: Path) -> None:
    key = f"mplicits {MODEL.sha256()}"
    with visit(browser, page_file) as visited:
        visited.until(f"['literal', 'texture'].includes(localStorage.getItem('{key}'))")
        faster = visited.page.evaluate("key => localStorage.getItem(key)", key)
        visited.until(f"document.documentElement.dataset.storage === '{faster}'")
        assert visited.said == []
    for remembered, expected in (("texture", "texture"), ("trying", "texture"), ("literal", "literal")):
        with visit(browser, page_file, script=f"localStorage.setItem('{key}', '{remembered}')") as visited:
            if expected == "literal":
                visited.until("document.documentElement.dataset.storage === 'literal'")
            visited.still()
            assert visited.root("storage") == expected


UNFINISHED = """const ask = WebGL2RenderingContext.prototype.getProgramParameter, COMPLETION_STATUS_KHR = 0x91B1;
WebGL2RenderingContext.prototype.getProgramParameter = function (program, name) {
    const held = name === COMPLETION_STATUS_KHR && localStorage.getItem("%s") === "trying";
    return !held && ask.call(this, program, name);
};"""
"""Has the literals' compiler never end: %s is the key in localStorage that says that they are being tried."""


def test_opening_another_model_while_the_literals_compile_does_not_count_as_their_failure(
    browser: "Browser", page_file: Path, tmp_path: Path
) -> None:
    key = f"mplicits {MODEL.sha256()}"
    save(random_model((4, 0), name="other"), tmp_path / "other.safetensors")
    with visit(browser, page_file, script=UNFINISHED % key) as visited:
        visited.until(f"localStorage.getItem('{key}') === 'trying'")
        visited.page.set_input_files("#file", tmp_path / "other.safetensors")
        visited.until("document.title === 'other'")
        assert visited.page.evaluate("key => localStorage.getItem(key)", key) is None
        visited.still()
        assert visited.said == []


LIMITS = """const ask = WebGL2RenderingContext.prototype.getParameter;
WebGL2RenderingContext.prototype.getParameter = function (name) {
    return name === this.%s ? %d : ask.call(this, name);
};"""
"""Has the device claim another limit: %s is its name, %d its value."""


@pytest.mark.parametrize(
    ("init", "replaced", "said"),
    [
        ("HTMLCanvasElement.prototype.getContext = () => null;", None, "This browser shows no WebGL2"),
        (LIMITS % ("MAX_TEXTURE_SIZE", 512), None, "this device's largest side is 512"),
        (
            LIMITS % ("MAX_FRAGMENT_UNIFORM_VECTORS", 16),
            None,
            "The shader needs 24 uniform vectors; this device has 16.",
        ),
        ("", ("Hit ray = march(", "Hit ray = nothing("), "This device's compiler refuses the shader: ERROR: 0:"),
    ],
)
def test_the_page_says_in_one_message_what_the_device_cannot_do(
    init: str, replaced: tuple[str, str] | None, said: str, browser: "Browser", page_file: Path, tmp_path: Path
) -> None:
    file = tmp_path / "page.html"
    file.write_text(page_file.read_text().replace(*replaced or ("", "")))
    with visit(browser, file, script=init) as visited:
        visited.page.wait_for_selector("#message:not([hidden])")
        assert said in visited.message()
        assert visited.root("state") == "failed"
        assert visited.said == []


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
        assert visited.said == []
