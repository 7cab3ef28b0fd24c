"""The html page where things go wrong, and what it remembers of a device."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from mplicits.codegen.targets import glsl330
from mplicits.codegen.targets.webpage import script
from mplicits.model.model import save
from mplicits.viewer.draw.options import schedule_that_fits

from support.browser import visit
from support.page_pictures import MODEL, differ
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow


def test_a_lost_context_comes_back(browser: "Browser", page_file: Path) -> None:
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
        found = visited.page.evaluate("key => localStorage.getItem(key)", key)
        visited.until(f"document.documentElement.dataset.storage === '{found}'")
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


def test_a_model_opened_while_the_literals_compile_is_no_failure_of_theirs(
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


FIT = """
window.fit = (given) => fitting(...given);
null;
"""


@pytest.mark.parametrize(("iterations", "level"), [((20, 5), 2), ((20, 5), 1), ((60, 60), 2), ((200, 2), 2)])
def test_llvmpipe_is_asked_for_what_it_draws_whole(browser: "Browser", iterations: tuple[int, int], level: int) -> None:
    """Its fragments stop silently after 65,535 loop iterations: the page's schedule is the desktop's."""
    shader = glsl330.bake(random_model((40, 1), (64, 2), texture=(8, 0)), "texture")
    loops = {"value": shader.value_loops, "gradient": shader.gradient_loops, "texture": shader.texture_loops}
    page = browser.new_page()
    page.set_content("<!doctype html>")
    page.evaluate(script(("camera.js", "uniforms.js")) + FIT)
    found = page.evaluate("given => window.fit(given)", [loops, level, 2, iterations, 32])
    page.close()
    steps, rounds = schedule_that_fits(shader, level, 2, iterations, 32)
    assert (tuple(found["steps"]), found["rounds"]) == (steps, rounds)


LIMITS = """const ask = WebGL2RenderingContext.prototype.getParameter;
WebGL2RenderingContext.prototype.getParameter = function (name) {
    return name === this.%s ? %d : ask.call(this, name);
};"""


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
def test_what_a_device_cannot_do_is_one_message(
    init: str, replaced: tuple[str, str] | None, said: str, browser: "Browser", page_file: Path, tmp_path: Path
) -> None:
    file = tmp_path / "page.html"
    file.write_text(page_file.read_text().replace(*replaced or ("", "")))
    with visit(browser, file, script=init) as visited:
        visited.page.wait_for_selector("#message:not([hidden])")
        assert said in visited.message()
        assert visited.root("state") == "failed"
        assert visited.said == []


def test_without_float_targets_it_draws_all_the_same(browser: "Browser", page_file: Path) -> None:
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
