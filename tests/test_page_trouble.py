"""The html page where things go wrong, and what it remembers of a device."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from browser import chromium, visit
from codegen import glsl330
from codegen.model import load
from codegen.targets import TARGETS
from page_pictures import MODEL, desktop, differ
from viewer.camera import Camera
from viewer.context import Context
from viewer.options import LOOP_LIMIT, RenderOptions
from viewer.renderer import Renderer

if TYPE_CHECKING:
    from playwright.sync_api import Browser


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
        assert visited.root("storage") == found
        assert visited.said == []
    for remembered, expected in (("texture", "texture"), ("trying", "texture"), ("literal", "literal")):
        with visit(browser, page_file, script=f"localStorage.setItem('{key}', '{remembered}')") as visited:
            if expected == "literal":
                visited.until("document.documentElement.dataset.storage === 'literal'")
            visited.still()
            assert visited.root("storage") == expected


@pytest.mark.slow
def test_llvmpipe_draws_many_loops_whole(osmesa: Context, tmp_path: Path) -> None:
    """Its fragments stop silently after 65,535 iterations; the page asks for fewer rounds, as the desktop does."""
    demo = load(Path(__file__).parent / "data" / "demo.safetensors")
    model = replace(demo, levels=tuple(replace(level, iterations=60) for level in demo.levels))
    shader = glsl330.bake(model, "texture")
    assert shader.worst_loops(2, 2, shader.iterations, 32) > LOOP_LIMIT
    file = tmp_path / "demo.html"
    file.write_text(TARGETS["html"](model, storage="texture"))
    with chromium("llvmpipe") as llvmpipe, visit(llvmpipe, file) as visited:
        visited.still()
        assert not differ(visited.saved(), desktop(Renderer(osmesa, shader), Camera(), RenderOptions()))
        assert visited.said == []


LIMITS = """const ask = WebGL2RenderingContext.prototype.getParameter;
WebGL2RenderingContext.prototype.getParameter = function (name) {
    return name === this.%s ? %d : ask.call(this, name);
};"""


@pytest.mark.parametrize(("init", "replaced", "said"), [
    ("HTMLCanvasElement.prototype.getContext = () => null;", None, "This browser shows no WebGL2"),
    (LIMITS % ("MAX_TEXTURE_SIZE", 512), None, "this device's largest side is 512"),
    (LIMITS % ("MAX_FRAGMENT_UNIFORM_VECTORS", 16), None, "The shader needs 24 uniform vectors; this device has 16."),
    ("", ("Hit ray = march(", "Hit ray = nothing("), "This device's compiler refuses the shader: ERROR: 0:"),
])
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
