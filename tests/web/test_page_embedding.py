"""The page embedded in another page: parameters in the URL's hash, and messages to and from the host."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mplicits.codegen.targets.orbit import AZIMUTH
from mplicits.web.page import standalone
from support.browser import visit
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

HASH = "panel=0&turntable=20&background=cfe0f0"
HOST = """<!doctype html><iframe id="frame" src="page.html#t=0.25" style="width: 300px; height: 200px"></iframe>
<script>
const told = [], post = (message) => document.getElementById("frame").contentWindow.postMessage(message, "*");
addEventListener("message", ({data}) => told.push(data));
</script>"""
"""A page with a frame; `told` are the messages from it, and `post` sends one."""
WRONG: list[Any] = (
    ["a text", None, 7, [], {"azimuth": 77}, {"type": "other", "azimuth": 77}]
    + [{"type": "mplicits-set", "azimuth": 77} | more for more in ({"elevation": "5"}, {"unknown": 1}, {"time": 1.5})]
    + [{"type": "mplicits-set", "azimuth": 77} | more for more in ({"level": 1.5}, {"level": True}, {"distance": 0})]
    + [{"type": "mplicits-set", "azimuth": 77, "target": value} for value in ([1, 2], [0, 0, None], "000", [0, 0, 1e9])]
    + [{"type": "mplicits-set", "azimuth": value} for value in (None, [77], {"valueOf": 77}, 1e300)]
)
"""Messages that must change nothing."""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("embedding") / "page.html"
    path.write_text(standalone(random_model((4, 0)), poster=False, shade="phong"), encoding="utf-8")
    return path


@pytest.mark.slow
def test_the_hash_hides_the_panel_turns_the_shape_and_sets_the_background(browser: "Browser", page: Path) -> None:
    with visit(browser, page, size=(1000, 400), share=0.1, hash_="#" + HASH) as visited:
        visited.until("'drawn' in document.documentElement.dataset")
        for part in ("#panel", "#fold", "#status", "#name"):
            assert not visited.page.is_visible(part), part
        assert visited.root("tone") == "light"
        visited.page.evaluate("async () => { for (let i = 0; i < 10; i++) await new Promise(requestAnimationFrame); }")
        visited.page.keyboard.press("ArrowUp")
        visited.until("location.hash.includes('az=')")
        camera = visited.camera()
        assert (camera["panel"], camera["turntable"], camera["background"]) == ("0", "20", "cfe0f0")
        assert 0.1 < (float(camera["az"]) - AZIMUTH) % 360 < 350, "it has turned"
        visited.still()
        picture = visited.saved()
        assert picture.shape[1] == 100, "the canvas fills the window"
        np.testing.assert_allclose(picture[0, 0], [0xCF, 0xE0, 0xF0], atol=2)
        assert visited.console == []


@pytest.mark.slow
def test_invalid_values_in_the_hash_change_nothing(browser: "Browser", page: Path) -> None:
    with visit(browser, page, size=(1000, 400), share=0.1, hash_="#turntable=x&background=toString") as visited:
        visited.until("'ready' in document.documentElement.dataset")
        assert visited.page.is_visible("#panel")
        assert visited.root("tone") == "dark"
        visited.page.keyboard.press("ArrowUp")
        visited.until("location.hash.includes('az=')")
        assert float(visited.camera()["az"]) == pytest.approx(AZIMUTH)
        assert visited.console == []


def test_messages_set_the_view_and_tell_of_it(browser: "Browser", tmp_path: Path) -> None:
    model = random_model((4, 0), (4, 0), inputs="xyzt")
    (tmp_path / "page.html").write_text(standalone(model, poster=False, shade="phong"), encoding="utf-8")
    (tmp_path / "host.html").write_text(HOST)
    with visit(browser, tmp_path / "host.html", share=0.1) as visited:
        visited.until("told.length")
        assert visited.page.evaluate("told") == [{"type": "mplicits-ready", "levels": 2, "moves": True}]
        frame = visited.page.frames[1]
        for message in WRONG:
            visited.page.evaluate("message => post(message)", message)
        visited.page.evaluate("post({type: 'mplicits-set', level: NaN, azimuth: 77})")
        right = {"elevation": 30, "distance": 5, "target": [0.1, 0, -0.2], "level": 1, "time": 0.5}
        visited.page.evaluate("message => post({type: 'mplicits-set', ...message})", right)
        frame.wait_for_function("() => location.hash.includes('az=')")
        assert frame.evaluate("location.hash") == f"#az={AZIMUTH:g}&el=30&d=5&at=0.1,0,-0.2&t=0.5"
        assert frame.evaluate("document.querySelector('#level input:checked').value") == "1"
        assert frame.evaluate("document.getElementById('time').value") == "0.5"
        assert len(visited.page.evaluate("told")) == 1, "the host is not told of its own message"
        frame.press("#view", "ArrowLeft")
        visited.until("told.length === 2")
        camera = visited.page.evaluate("told[1]")
        assert camera.pop("azimuth") != AZIMUTH
        view = {"elevation": 30, "distance": 5, "target": [0.1, 0, -0.2]}
        assert camera == {"type": "mplicits-camera"} | view
        assert visited.console == []


@pytest.mark.slow
def test_a_page_without_a_host_takes_no_messages(browser: "Browser", page: Path) -> None:
    with visit(browser, page, share=0.1, hash_="#az=10") as visited:
        visited.until("'ready' in document.documentElement.dataset")
        visited.page.evaluate("""() => new Promise((resolve) => {
            addEventListener("message", resolve);
            postMessage({type: "mplicits-set", azimuth: 77});
        })""")
        visited.page.keyboard.press("ArrowUp")
        visited.until("location.hash.includes('el=')")
        assert visited.camera()["az"] == "10"
