"""The page where things happen early, late or at once: drops, Play, a save in motion, a save without a context."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits.model.model_file import to_bytes
from mplicits.web.page import standalone
from support.browser import Visit, held_compilers, visit
from support.moving_model import moving_model
from support.page_pictures import remembering
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

MODEL = moving_model((16, 24))
SLOW = """
const {arrayBuffer} = Blob.prototype;
window.isCompiling = false;
window.isReading = new Promise((resolve) => { window.read = resolve; });
Blob.prototype.arrayBuffer = async function () {
    if (this.name === "slow.safetensors") await window.isReading;
    return arrayBuffer.call(this);
};
"""
"""Holds the reading of a file."""
FRAMES = """
const frames = [], usual = requestAnimationFrame;
window.isHeld = false;
window.requestAnimationFrame = (work) => (window.isHeld ? frames.push(work) : usual.call(window, work));
window.frame = async () => {
    for (const work of frames.splice(0)) work(performance.now());
    for (let i = 0; i < 20; ++i) await null;
};"""
"""Holds frames; frame() draws one."""


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(standalone(MODEL, poster=False, shade="phong"))
    return path


def opened_model(visited: Visit, name: str) -> None:
    visited.drop(to_bytes(random_model((4, 0), name=name)), f"{name}.safetensors")


def test_the_last_dropped_file_stays(browser: "Browser", page_file: Path) -> None:
    """Also where one before it takes longer to read, or one after it is damaged."""
    with visit(browser, page_file, share=0.1, script=held_compilers("window.isCompiling") + SLOW) as visited:
        visited.still()
        opened_model(visited, "slow")
        opened_model(visited, "quick")
        visited.page.evaluate("""async () => {
            window.isCompiling = true;
            const turn = () => new Promise((resolve) => setTimeout(resolve));
            for (let i = 0; i < 20; ++i) await turn(); // the quick file is read
            window.read();
            for (let i = 0; i < 20; ++i) await turn();
        }""")
        visited.until("document.title === 'quick'")
        visited.drop(b"nothing", "damaged.safetensors")
        visited.page.wait_for_selector("#message:not([hidden])")
        assert visited.message().startswith("damaged.safetensors: ")
        assert visited.root("state") == "compiling"
        visited.page.evaluate("() => { window.isCompiling = false; }")
        visited.until("document.documentElement.dataset.state !== 'compiling'")
        visited.still()
        assert visited.page.title() == "quick"
        assert visited.console == []


def test_play_pressed_thrice_in_a_frame_plays_at_the_same_speed(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, share=0.1, script=remembering(MODEL, "texture") + FRAMES) as visited:
        visited.still()
        changes = visited.page.evaluate("""async () => {
            const press = () => document.getElementById("play").click();
            let changes = 0;
            window.isHeld = true;
            press();
            await frame();
            press();
            press();
            await frame();
            Object.defineProperty(document.getElementById("time"), "value", {set() { ++changes; }});
            await frame();
            return changes;
        }""")
        assert changes == 1


def test_a_turning_shape_is_saved(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, share=0.1, hash_="#turntable=3600") as visited:
        visited.until("'drawn' in document.documentElement.dataset")
        assert visited.saved().std() > 5
        assert visited.console == []


def test_nothing_is_saved_of_a_lost_context(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, share=0.1) as visited:
        visited.still()
        downloads = list[str]()
        visited.page.on("download", lambda download: downloads.append(download.url))
        visited.lose_context()
        visited.until("document.documentElement.dataset.state === 'lost'")
        visited.page.keyboard.press("s")
        visited.until("!document.getElementById('save').disabled")
        visited.restore_context()
        visited.still()
        assert visited.saved().std() > 5
        assert (len(downloads), visited.console) == (1, [])


def test_a_hash_counts_though_the_page_replaces_it(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, share=0.1) as visited:
        visited.still()
        visited.page.evaluate("""() => {
            location.hash = "#az=70&el=-15";
            history.replaceState(null, "", "#az=1&el=2");
        }""")
        visited.until("location.hash.startsWith('#az=70&el=-15')")
        assert visited.console == []
