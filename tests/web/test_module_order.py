"""Elements <mplicits-view> where things come early, late or at once: modules, files, attributes, contexts, visitors."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from support.module_site import BALL, STARTED, site, write_files

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of modules and model files."""
    return write_files(tmp_path_factory.mktemp("files"))


@pytest.mark.slow
def test_a_model_may_come_in_any_order(browser: "Browser", files: Path) -> None:
    """From a module that a script imports late; from a file that comes when its element is away, or has another."""
    body = f"""{BALL}<mplicits-view id="late" model="other"></mplicits-view>
<mplicits-view id="away" src="ball.safetensors"></mplicits-view>
<mplicits-view id="moved" src="ball.safetensors"></mplicits-view>
<mplicits-view id="changed" src="ball.safetensors"></mplicits-view>"""
    missing = 'mplicits-view: model="other": no module of this page has it; there is fitted'
    with site(browser, files, body, lines=[missing]) as opened:
        page = opened.page
        opened.hold("ball.safetensors")
        page.wait_for_function(STARTED)
        opened.told("late", "error")
        opened.asked("ball.safetensors")
        page.evaluate("""() => {
            const [away, moved] = [of("away"), of("moved")];
            away.remove();
            away.setAttribute("src", "other.safetensors");
            document.body.prepend(moved);
            document.body.append(away);
            of("changed").setAttribute("src", "other.safetensors");
        }""")
        opened.told("changed", "load")
        opened.told("away", "load")
        opened.let("ball.safetensors")
        page.evaluate("() => { import('./other.js'); }")
        for view in ("late", "moved"):
            opened.told(view, "load")
        assert [opened.label(view) for view in ("late", "away", "moved", "changed")] == [
            "other",
            "other",
            "fitted",
            "other",
        ]
        page.evaluate(
            "() => { const away = of('away'); away.remove(); away.removeAttribute('src'); document.body.append(away); }"
        )
        opened.told("away", "load", 2)
        assert opened.label("away") == "fitted"


def test_a_file_that_failed_may_be_set_again(browser: "Browser", files: Path) -> None:
    body = f'{BALL}<mplicits-view id="a" src="ball.safetensors"></mplicits-view>'
    lines = ["Failed to load resource: the server responded with a status of 404 (Not Found)"]
    lines += ["mplicits-view: ball.safetensors cannot be loaded: 404 Not Found"]
    with site(browser, files, body, lines=lines) as opened:
        opened.missing.add("ball.safetensors")
        opened.page.wait_for_function(STARTED)
        opened.told("a", "error")
        opened.missing.clear()
        opened.page.evaluate("() => of('a').setAttribute('src', 'ball.safetensors')")
        opened.told("a", "load")
        assert opened.events("a")[:2] == ["error", "load"]


@pytest.mark.slow
def test_what_is_set_while_an_element_is_hidden_holds(browser: "Browser", files: Path) -> None:
    """Also its picture: a hidden element keeps it until it draws again."""
    body = f"""{BALL}<mplicits-view id="a" src="moving.safetensors" autoplay camera-controls camera-orbit="10deg 60deg">
</mplicits-view>"""
    with site(browser, files, body) as opened:
        page = opened.page
        page.wait_for_function(STARTED)
        opened.told("a", "poster-dismissed")
        page.wait_for_function("() => !of('a').paused")
        page.evaluate("() => { of('a').style.display = 'none'; }")
        page.wait_for_function("() => !canvases('a')")
        assert page.evaluate("() => of('a').shadowRoot.querySelector('.still').width") == 48
        page.evaluate("""() => {
            of("a").pause();
            of("a").setAttribute("camera-orbit", "90deg 60deg");
            of("a").style.display = "";
        }""")
        opened.told("a", "load", 2)
        orbit = page.evaluate("() => of('a').getCameraOrbit()")
        assert orbit["theta"] == pytest.approx(1.5708, abs=1e-3)
        assert page.evaluate("() => of('a').paused")


def test_a_picture_is_saved_while_the_shape_turns(browser: "Browser", files: Path) -> None:
    with site(browser, files, f'{BALL}<mplicits-view id="a" turntable="5"></mplicits-view>') as opened:
        page = opened.page
        page.wait_for_function(STARTED)
        opened.told("a", "camera-change")
        assert page.evaluate("async () => (await of('a').toBlob()).size") > 500
        before = page.evaluate("() => of('a').getCameraOrbit().theta")
        page.wait_for_function("before => of('a').getCameraOrbit().theta !== before", arg=before)
        refused = page.evaluate("""() => {
            const picture = of("a").toBlob().then(() => "a blank picture", ({message}) => message);
            of("a").remove();
            return picture;
        }""")
        assert refused == "There is no picture to save: its graphics context is lost."


DENSITY = """
const usual = matchMedia, densities = [];
window.matchMedia = (query) => {
    const list = usual(query);
    if (query.includes("resolution")) densities.push(list);
    return list;
};
window.tellDensity = () => densities.at(-1).dispatchEvent(new Event("change"));"""
"""Chromium tells no page of the density that a test sets."""


@pytest.mark.slow
def test_pixels_are_as_dense_as_the_screen_that_the_window_moves_to(browser: "Browser", files: Path) -> None:
    with site(browser, files, f'{BALL}<mplicits-view id="a"></mplicits-view>', DENSITY) as opened:
        page = opened.page
        page.wait_for_function(STARTED)
        opened.told("a", "poster-dismissed")
        session, widths = page.context.new_cdp_session(page), list[int]()
        for density in (2, 1.5):
            screen = {"width": 400, "height": 400, "deviceScaleFactor": density, "mobile": False}
            session.send("Emulation.setDeviceMetricsOverride", screen)
            page.evaluate("tellDensity()")
            widths.append(page.evaluate("of('a').shadowRoot.querySelector('canvas:not(.still)').width"))
        assert widths == [96, 72]


COUNT = """
const {getContext} = HTMLCanvasElement.prototype, contexts = [];
window.most = 0;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    const context = getContext.call(this, kind, ...more);
    if (kind === "webgl2" && !contexts.includes(context)) contexts.push(context);
    window.most = Math.max(window.most, contexts.filter((one) => !one.isContextLost()).length);
    return context;
};"""
"""Counts the graphics contexts that live at once."""


@pytest.mark.slow
def test_all_of_many_elements_get_their_picture(browser: "Browser", files: Path) -> None:
    more = "shade='phong' turntable='5' camera-controls"
    views = "".join(f"<mplicits-view id='v{i}' {more}></mplicits-view>" for i in range(20))
    body = f"{BALL}<style>mplicits-view {{ float: left; }}</style>{views}"
    with site(browser, files, body, COUNT) as opened:
        page = opened.page
        page.wait_for_function(STARTED)
        for i in range(20):
            opened.told(f"v{i}", "poster-dismissed")
        assert page.evaluate("window.most") == 8
        page.wait_for_function("() => log.filter(([, type]) => type === 'load').length === 20")
        resting = page.evaluate("[...document.querySelectorAll('mplicits-view')].find(({id}) => !canvases(id)).id")
        page.hover(f"#{resting}")
        opened.told(resting, "load", 2)
        assert page.evaluate("window.most") == 8


HOLD = """
const {setTimeout} = window, late = [], {fenceSync} = WebGL2RenderingContext.prototype;
window.isHeld = false;
WebGL2RenderingContext.prototype.fenceSync = function (...all) {
    window.drew?.();
    return fenceSync.apply(this, all);
};
window.setTimeout = (work, ...more) => (window.isHeld ? late.push(work) : setTimeout(work, ...more));
window.goOn = () => {
    window.isHeld = false;
    late.splice(0).forEach((work) => work());
};
window.reset = async (canvas, passed) => {
    const context = canvas.getContext("webgl2"), extension = context.getExtension("WEBGL_lose_context");
    const told = (type) => new Promise((resolve) => canvas.addEventListener(type, resolve, {once: true}));
    const lost = told("webglcontextlost"), back = told("webglcontextrestored");
    extension.loseContext();
    await lost;
    passed?.();
    setTimeout(() => extension.restoreContext());
    await back;
};"""
"""Holds all timers, as in a hidden tab; takes a canvas's context for a moment; `drew` hears of each drawing."""


def test_a_context_lost_while_loading_delays_the_load(browser: "Browser", files: Path) -> None:
    """Also where the page's timers see only what came after."""
    with site(browser, files, f'{BALL}<mplicits-view id="a" src="ball.safetensors"></mplicits-view>', HOLD) as opened:
        page = opened.page
        opened.hold("ball.safetensors")
        page.wait_for_function(STARTED)
        opened.asked("ball.safetensors")
        page.evaluate("""() => { window.lost = new Promise((resolve) => {
            new MutationObserver(async ([{addedNodes: [canvas]}]) => {
                if (window.loads !== undefined || canvas.className === "still") return;
                window.loads = -1;
                window.isHeld = true;
                await reset(canvas, () => { window.loads = log.length; });
                goOn();
                resolve();
            }).observe(of("a").shadowRoot, {childList: true});
        }); }""")
        opened.let("ball.safetensors")
        page.evaluate("window.lost")
        opened.told("a", "poster-dismissed")
        assert page.evaluate("window.loads") == 0
        assert opened.events("a") == ["load", "poster-dismissed"]
        # While it is shown, once the picture is finished: the poster covers the blank canvas.
        page.evaluate("async () => { await of('a').toBlob(); }")
        covered = page.evaluate("""async () => {
            const canvas = of("a").shadowRoot.querySelector("canvas:not(.still)");
            let covered = null;
            const drawn = new Promise((resolve) => {
                window.drew = () => {
                    window.isHeld = true;
                    window.drew = null;
                    resolve();
                };
            });
            of("a").setAttribute("level", "1");
            await drawn;
            await reset(canvas, () => { covered = !of("a").shadowRoot.querySelector(".poster").hidden; });
            goOn();
            return covered;
        }""")
        assert covered
        opened.told("a", "poster-dismissed", 2)
        assert opened.events("a").count("load") == 1
