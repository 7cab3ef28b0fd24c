"""The web page before its first picture, its layout, its contrast, and its accessibility."""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits.model.model_file import to_bytes
from support.browser import Visit, held_compilers, visit
from support.page_pictures import MODEL, remembering
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

WINDOW = (1280, 800)
SHARE = 0.05
"""Device pixels per CSS pixel."""
QUICK, OTHERS = ("slate", "paper"), ("night", "sky")
"""Backgrounds: a dark and a light one, and the rest."""
TEXTURE = remembering(MODEL, "texture")
HOLD = (
    TEXTURE
    + """window.held = window.slow = true;
const context = WebGL2RenderingContext.prototype, times = new WeakMap(), {fenceSync, getSyncParameter} = context;
context.fenceSync = function (...values) {
    const sync = fenceSync.apply(this, values);
    times.set(sync, performance.now());
    return sync;
};
context.getSyncParameter = function (sync, name) {
    const isEarly = window.slow && performance.now() - times.get(sync) < 30;
    return isEarly ? this.UNSIGNALED : getSyncParameter.call(this, sync, name);
};"""
    + held_compilers("window.held")
)
"""Compilers never finish while `held` is set, and each draw takes 30 ms while `slow` is set; no literals."""
WATCH = """() => {
    window.seen = {status: [], spoken: [], bar: [], covered: []};
    const element = (id) => document.getElementById(id);
    const watch = (id, list, read) => new MutationObserver(() => list.push(read(element(id)))).observe(
        element(id), {attributes: true, childList: true, characterData: true, subtree: true});
    watch("status", window.seen.status, (line) => line.textContent.split("\\n")[0]);
    watch("status", window.seen.covered, () => getComputedStyle(element("view")).opacity === "0");
    watch("spoken", window.seen.spoken, (line) => line.textContent);
    watch("progress", window.seen.bar, (bar) => bar.hidden ? "gone" : bar.getAttribute("aria-valuenow") ?? "unknown");
}"""
"""Records each text of the status line and of the live region, and each value of the bar."""
UNREADABLE = """() => {
    const canvas = Object.assign(document.createElement("canvas"), {width: 1, height: 1});
    const pen = canvas.getContext("2d", {willReadFrequently: true});
    const paint = (colors) => {
        for (const color of colors) {
            pen.fillStyle = color;
            pen.fillRect(0, 0, 1, 1);
        }
        const linear = (c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
        const [r, g, b] = [...pen.getImageData(0, 0, 1, 1).data].map((byte) => linear(byte / 255));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const found = [];
    for (const element of document.querySelectorAll("body *:not(script, style, .unseen, .unseen *)")) {
        const own = [...element.childNodes].filter((node) => node.nodeType === Node.TEXT_NODE);
        const text = own.map((node) => node.data).join("").trim();
        if (!text || !element.checkVisibility({visibilityProperty: true})) continue;
        const layers = [];
        let above = element;
        for (; above && above.id !== "stage"; above = above.parentElement)
            layers.unshift(getComputedStyle(above).backgroundColor);
        const {color} = getComputedStyle(element);
        for (const behind of above ? ["black", "white"] : ["black"]) {
            const [dark, light] = [paint([behind, ...layers]), paint([behind, ...layers, color])].sort((a, b) => a - b);
            const contrast = (light + 0.05) / (dark + 0.05);
            window.texts = (window.texts ?? 0) + 1;
            if (contrast < 4.5) found.push(`${text}: ${contrast.toFixed(2)} on ${behind}`);
        }
    }
    return found;
}"""
"""Finds texts with less contrast than WCAG's 4.5 to their background, or, on the picture, to black or white."""


@pytest.fixture(scope="module")
def wide(browser: "Browser", page_file: Path) -> Iterator[Visit]:
    """A page with room for the panel; each test closes its messages."""
    with visit(browser, page_file, WINDOW, SHARE, TEXTURE) as visited:
        visited.still()
        yield visited
        assert visited.console == []


def picture(opened: Visit) -> NDArray[np.int64]:
    """Return a screenshot, (H, W, 3)."""
    return np.asarray(Image.open(io.BytesIO(opened.page.screenshot())).convert("RGB")).astype(int)


def box(opened: Visit, selector: str) -> tuple[float, float, float, float]:
    """Return the left, top, right and bottom edge of an element, CSS pixels."""
    found = opened.page.locator(selector).bounding_box()
    assert found is not None
    return found["x"], found["y"], found["x"] + found["width"], found["y"] + found["height"]


@pytest.mark.parametrize("scheme", ["dark", pytest.param("light", marks=pytest.mark.slow)])
def test_the_first_paint_has_the_background_of_the_picture(scheme: str, browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, WINDOW, SHARE, HOLD, "#az=100&el=20", color_scheme=scheme) as visited:
        visited.until("document.documentElement.dataset.state === 'compiling'")
        before = picture(visited)
        visited.page.evaluate("window.held = window.slow = false")
        visited.still()
        visited.until("getComputedStyle(document.getElementById('view')).opacity === '1'")
        after = picture(visited)
        edge = np.s_[[0, 10, 20, 30, 35], 46]
        assert np.ptp(before[edge].mean(axis=-1)) > 10, "it is a gradient"
        assert np.abs(after[edge] - before[edge]).max() <= 3
        assert np.abs(after[20, 24] - before[20, 24]).max() > 20, "the shape was not there"
        assert visited.console == []


@pytest.mark.slow
def test_bar_status_line_and_live_region_report_the_state(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, WINDOW, SHARE, HOLD, reduced_motion="reduce") as visited:
        page = visited.page
        visited.until("document.documentElement.dataset.state === 'compiling'")
        assert page.inner_text("#status") == page.inner_text("#spoken") == "Compiling the shader"
        assert page.is_visible("#progress")
        assert page.get_attribute("#progress", "aria-valuenow") is None
        assert page.evaluate("getComputedStyle(document.querySelector('#progress div')).animationName") == "none"
        page.evaluate(WATCH)
        page.evaluate("window.held = false")
        visited.until("window.seen.bar.filter((value) => value > 0).length > 2")
        page.evaluate("window.slow = false")
        visited.still()
        seen = page.evaluate("window.seen")
        shares = [int(value) for value in dict.fromkeys(seen["bar"]) if value.isdecimal()]
        assert shares == sorted(shares)
        assert seen["bar"][-1] == "gone"
        assert any(line.startswith("Drawing 48 × 40 · ") for line in seen["status"])
        assert seen["status"][-1].endswith("samples")
        assert seen["spoken"] == ["The picture is drawn"]
        covered = [line for line, covers in zip(seen["status"], seen["covered"], strict=True) if covers]
        assert any("×" in line for line in covered), "frames coarser than the poster stay hidden"
        assert not seen["covered"][-1]
        page.evaluate("window.held = true")
        page.keyboard.press("ArrowLeft")
        visited.until("document.documentElement.dataset.state === 'drawing'")
        page.evaluate("window.held = false")
        visited.still()
        assert page.evaluate("window.seen.spoken") == seen["spoken"], "later views are not announced"
        assert visited.console == []


def test_a_gesture_is_seen_before_the_shader_is_compiled(browser: "Browser", page_file: Path) -> None:
    """The poster turns with the keys; the first frame, however coarse, replaces it."""
    with visit(browser, page_file, WINDOW, SHARE, HOLD) as visited:
        visited.until("document.documentElement.dataset.state === 'compiling'")
        before = picture(visited)
        for _ in range(4):
            visited.page.keyboard.press("ArrowLeft")
        assert visited.page.inner_text("#status") == "Compiling the shader · the view follows in a moment"
        assert np.abs(picture(visited) - before).max() > 20
        visited.page.evaluate("window.held = false")
        visited.until("'drawn' in document.documentElement.dataset")
        assert visited.root("state") == "drawing"
        visited.page.evaluate("window.slow = false")
        visited.still()
        assert visited.console == []


@pytest.mark.parametrize("background", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)])
def test_every_text_has_contrast_on_every_background(background: str, wide: Visit) -> None:
    wide.page.evaluate("name => document.querySelector(`#background input[value=${name}]`).click()", background)
    for key in "xp":  # on the dark background of the heat map, and on its own
        wide.page.keyboard.press(key)
        assert wide.page.evaluate(UNREADABLE) == []
    assert wide.page.evaluate("window.texts") > 50
    wide.page.evaluate("""() => {
        document.getElementById("message").hidden = document.getElementById("drop").hidden = false;
        document.querySelector("#message p").textContent = "Something to read";
    }""")
    assert wide.page.evaluate(UNREADABLE) == []
    assert wide.violations() == []
    wide.page.evaluate("document.getElementById('drop').hidden = true")
    wide.page.click("#message button")
    wide.page.keyboard.press("p")


def test_the_heat_map_has_a_dark_background_and_light_text(wide: Visit) -> None:
    wide.page.evaluate("document.querySelector('#background input[value=paper]').click()")
    ink = "getComputedStyle(document.querySelector('h1')).color"
    dark = wide.page.evaluate(ink)
    wide.page.keyboard.press("x")
    assert wide.page.evaluate(ink) != dark
    assert wide.root("tone") == "light", "the panel stays as it is"
    wide.page.keyboard.press("p")
    assert wide.page.evaluate(ink) == dark


def test_screen_readers_get_names_values_and_live_regions(wide: Visit) -> None:
    session = wide.page.context.new_cdp_session(wide.page)
    wide.page.evaluate("document.getElementById('moment').hidden = false")
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    wide.page.evaluate("document.getElementById('moment').hidden = true")
    roles: dict[str, dict[str, dict[str, Any]]] = {}
    for node in nodes:
        if not node["ignored"]:
            properties = {entry["name"]: entry["value"].get("value") for entry in node.get("properties", ())}
            role, name = node["role"]["value"], node.get("name", {}).get("value", "")
            roles.setdefault(role, {})[name] = properties | {"value": node.get("value", {}).get("value")}
    assert set(roles["slider"]) == {"Iterations", "Time", "Direction of the light"}
    light = roles["slider"]["Direction of the light"]
    assert (light["valuemin"], light["valuemax"], light["value"]) == (-180, 180, 126)
    texts = "[iterations, light].map((slider) => slider.ariaValueText)"
    assert wide.page.evaluate(texts) == ["20, 5 steps", "126 degrees from the right, 47 from the viewer"]
    buttons = {
        "Controls",
        "Play",
        "Save PNG",
        "Full screen",
        "Reset view",
        "Open model",
        "Share",
        "Embed",
        "Copy as Shadertoy",
    }
    assert set(roles["button"]) == buttons
    assert {"Shading", "Level", "Normals from level", "Background", "Resolution"} <= set(roles["group"])
    live = """() => [...document.querySelectorAll("output, [role=status], [role=alert], [aria-live]")]
        .filter((element) => element.ariaLive !== "off").map((element) => element.id || element.parentElement.id)"""
    assert wide.page.evaluate(live) == ["spoken", "message"]


def test_the_folded_page_is_accessible(wide: Visit) -> None:
    wide.page.keyboard.press("h")
    assert wide.violations() == []
    assert wide.page.evaluate(UNREADABLE) == []
    wide.page.keyboard.press("h")


@pytest.mark.slow
def test_the_canvas_fills_the_space_beside_the_panel(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, (899, 900), SHARE, HOLD) as visited:
        for width, is_open in ((899, False), (900, True)):
            visited.page.set_viewport_size({"width": width, "height": 900})
            visited.page.reload()
            visited.until("'ready' in document.documentElement.dataset")
            assert visited.page.is_visible("#panel") == is_open
            assert visited.page.get_attribute("#fold", "aria-expanded") == str(is_open).lower()
            if not is_open:
                assert box(visited, "#view") == (0, 0, width, 900)
            visited.unfold()
            assert box(visited, "#view") == (0, 0, box(visited, "#side")[0], 900)
            visited.until(f"document.getElementById('view').width === Math.round({SHARE} * (innerWidth - 316))")


@pytest.mark.slow
def test_a_phone_starts_folded_and_shows_its_whole_sheet(browser: "Browser", page_file: Path) -> None:
    phone: dict[str, Any] = {"has_touch": True, "is_mobile": True, "color_scheme": "light"}
    with visit(browser, page_file, (390, 844), SHARE, HOLD, **phone) as visited:
        visited.until("'ready' in document.documentElement.dataset")
        assert visited.root("tone") == "light"
        assert not visited.page.is_visible("#panel")
        visited.page.tap("#fold")
        visited.page.wait_for_selector("#panel")  # a tap becomes a click later
        left, _, right, _ = box(visited, "#panel")
        assert 0 <= left < right <= 390
        assert visited.page.evaluate("document.documentElement.scrollWidth") == 390
        last = box(visited, ".buttons > :last-child:not([hidden])")
        assert last[3] < 844
        assert visited.page.evaluate("(({scrollHeight, clientHeight}) => scrollHeight - clientHeight)(panel)") == 0
        assert box(visited, "#view")[3] == box(visited, "#side")[1] >= 320
        legends = visited.page.locator("legend").all()
        for legend in legends:
            under = legend.evaluate("""legend => {
                const {left, top, width, height} = legend.getBoundingClientRect();
                return document.elementFromPoint(left + width / 2, top + height / 2).tagName;
            }""")
            assert under == "LEGEND", "nothing lies over a heading"


def test_a_dropped_mesh_gets_another_message_than_a_damaged_model(wide: Visit) -> None:
    for name, expected in {
        "spot.obj": "spot.obj: a mesh; train it with: mplicits train spot.obj, "
        "or drop it on the page of: mplicits studio",
        "It's a <b>cow.PLY": "It's a <b>cow.PLY: a mesh or a point cloud; "
        """train it with: mplicits train 'It'"'"'s a <b>cow.PLY', or drop it on the page of: mplicits studio""",
        "-\u202ex.npz": "-\\u{202e}x.npz: a point cloud; train it with: mplicits train './-\\u{202e}x.npz'",
    }.items():
        wide.drop(b"v 0 0 0", name)
        wide.page.wait_for_selector("#message:not([hidden])")
        assert wide.message() == expected
        wide.page.click("#message button")
        wide.page.wait_for_selector("#message", state="hidden")


def test_without_webgl2_the_panel_is_hidden(browser: "Browser", page_file: Path) -> None:
    with visit(browser, page_file, WINDOW, script="HTMLCanvasElement.prototype.getContext = () => null;") as visited:
        visited.page.wait_for_selector("#message:not([hidden])")
        assert visited.message().startswith("This browser shows no WebGL2")
        assert visited.root("state") == "failed"
        for selector in ("#side", "#fold", "#view", "#progress", "#message button"):
            assert not visited.page.is_visible(selector)
        assert box(visited, "#stage") == (0, 0, *WINDOW)
        assert visited.violations() == []
        assert visited.console == []


def test_a_dropped_model_is_centered_and_fits(wide: Visit) -> None:
    wide.follow("#az=100&el=-10&d=2&at=0.5,0.5,0")
    wide.drop(to_bytes(random_model((4, 0), name="other")), "other.safetensors")
    wide.until("location.hash === '#az=100&el=-10' && document.title === 'other'")
