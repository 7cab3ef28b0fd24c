"""Elements <mplicits-view> and createMesh where something fails: a line says why, and the poster stays."""

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import mplicits
from support import needs
from support.browser import PATIENCE, listen
from support.fitted_model import fitted_model
from support.module_pages import module_page, three_js
from support.module_site import BALL, STARTED, Site, site, write_files

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PIXEL = "data:image/gif;base64,R0lGODlhAQABAPAAAP8AAAAAACH5BAAAAAAALAAAAAABAAEAAAICRAEAOw=="
"""A red picture of one pixel."""
STATE = """id => {
    const {shadowRoot} = of(id), [poster, note, image] = [".poster", ".note", ".poster img"].map(
        (name) => shadowRoot.querySelector(name));
    const {width, height} = image.getBoundingClientRect();
    return [canvases(id), poster.hidden, note.textContent, width, height];
}"""
"""What an element shows: its canvases, whether its poster is hidden, its line, the sides of its poster's picture."""
WEBGL = "WebGL2RenderingContext.prototype"
TROUBLES = {
    "no WebGL2": (
        "HTMLCanvasElement.prototype.getContext = () => null;",
        "This browser shows no WebGL2, which the picture needs. ",
        "loadfailure",
    ),
    "a driver that refuses": (
        f"""const {{getProgramParameter, LINK_STATUS}} = {WEBGL};
{WEBGL}.getProgramParameter = function (program, name) {{
    return name !== LINK_STATUS && getProgramParameter.call(this, program, name);
}};""",
        "This device's compiler refuses the shader: ",
        "loadfailure",
    ),
    "a driver that dies": (
        f"""const {{drawArrays}} = {WEBGL};
window.deaths = 0;
{WEBGL}.drawArrays = function (...all) {{
    const extension = this.getExtension("WEBGL_lose_context");
    if (!extension) return;
    ++window.deaths;
    this.canvas.addEventListener("webglcontextlost", ({{defaultPrevented}}) => {{
        if (defaultPrevented) setTimeout(() => extension.restoreContext());
    }}, {{once: true}});
    extension.loseContext();
}};""",
        "The graphics driver fails at this model. ",
        "webglcontextlost",
    ),
}
"""What a browser lacks -> a script that takes it, the beginning of the line, and the type of the error."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of modules and model files."""
    return write_files(tmp_path_factory.mktemp("files"))


def details(opened: Site, view: str) -> Any:
    """Return the details of an element's errors, recorded by ERRORS."""
    return opened.page.evaluate(
        "id => errors.filter(([one]) => one === id).map(([, type, text]) => [type, text])", view
    )


ERRORS = """window.errors = [];
addEventListener("error", ({target, detail}) => {
    if (detail) errors.push([target.id, detail.type, detail.sourceError.message]);
}, true);"""


def test_a_missing_file_is_named_over_the_poster(browser: "Browser", files: Path) -> None:
    body = f"""{BALL}<style>mplicits-view {{ width: 300px; height: 200px; }}</style>
<mplicits-view id="a" src="cow.safetensors" poster="{PIXEL}"></mplicits-view>
<mplicits-view id="quiet" src="cow.safetensors"></mplicits-view>
<script>document.querySelector("#quiet").addEventListener("error", (event) => event.preventDefault());</script>"""
    line = "cow.safetensors cannot be loaded: 404 Not Found"
    lines = 3 * ["Failed to load resource: the server responded with a status of 404 (Not Found)"]
    lines.append(f"mplicits-view: {line}")
    with site(browser, files, body, ERRORS, lines=lines, device_scale_factor=0.2) as opened:
        opened.missing.add("cow.safetensors")
        opened.page.wait_for_function(STARTED)
        for view in ("a", "quiet"):
            opened.told(view, "error")
            assert details(opened, view) == [["loadfailure", line]]
        assert opened.page.evaluate(STATE, "a") == [0, False, line, 300, 200]
        assert opened.page.evaluate(STATE, "quiet")[2] == ""
        load = (
            "() => import('./ball.js').then((all) => all.loadModel('cow.safetensors')).catch((error) => error.message)"
        )
        assert opened.page.evaluate(load) == line
        opened.page.evaluate("() => of('a').src = 'other.safetensors'")
        opened.told("a", "poster-dismissed")
        assert opened.page.evaluate(STATE, "a")[:3] == [1, True, ""]


@pytest.mark.parametrize("name", TROUBLES)
def test_the_poster_stays_where_nothing_can_be_drawn(name: str, browser: "Browser", files: Path) -> None:
    script, line, kind = TROUBLES[name]
    body = '<script type="module" src="other.js"></script><mplicits-view id="a" loading="eager"></mplicits-view>'
    console = list[str]()
    with site(browser, files, body, ERRORS + script, lines=console) as opened:
        opened.page.wait_for_function(STARTED)
        opened.told("a", "error")
        [(told, text)] = details(opened, "a")
        console.append(f"mplicits-view: {text}")
        assert told == kind
        assert text.startswith(line)
        opened.page.evaluate("() => { of('a').level = 1; of('a').style.width = '60px'; }")
        opened.page.wait_for_timeout(300)
        assert opened.page.evaluate(STATE, "a") == [0, False, text, 60, 48]
        assert opened.events("a") == ["error"]
        if name == "a driver that dies":
            assert opened.page.evaluate("deaths") == 2


def test_properties_are_attributes_also_before_the_element_is_defined(browser: "Browser", files: Path) -> None:
    early = "{src: 'moving.safetensors', level: 1, cameraOrbit: '90deg 60deg', touchAction: 'none', currentTime: 0.5}"
    body = f"""<mplicits-view id="a" turntable></mplicits-view>
<script>Object.assign(document.querySelector("#a"), {early});</script>{BALL}"""
    with site(browser, files, body) as opened:
        opened.page.wait_for_function(STARTED)
        opened.told("a", "load")
        texts = opened.page.evaluate("() => ['src', 'level', 'camera-orbit'].map((name) => of('a').getAttribute(name))")
        assert texts == ["moving.safetensors", "1", "90deg 60deg"]
        kinds = opened.page.evaluate("() => [of('a').level, of('a').turntable, of('a').cameraControls, of('a').alt]")
        assert kinds == [1, 20, False, None]
        assert opened.page.evaluate("() => of('a').currentTime") == 0.5
        texts = opened.page.evaluate("""() => {
            Object.assign(of("a"), {level: null, cameraControls: true, turntable: 7, autoplay: true});
            return ["level", "camera-controls", "turntable"].map((name) => of("a").getAttribute(name));
        }""")
        assert texts == [None, "", "7"]
        opened.page.wait_for_function("() => !of('a').paused")


def test_the_module_does_nothing_on_a_server(files: Path) -> None:
    node = shutil.which("node") or needs.lack("Node")
    (files / "package.json").write_text('{"type": "module"}')
    script = """import {readFileSync} from "node:fs";
const {ownModel, loadModel} = await import("./ball.js"), file = readFileSync("ball.safetensors").toString("base64");
const loaded = await loadModel(`data:;base64,${file}`);
console.log(ownModel().name, loaded.levels.length);"""
    done = subprocess.run(
        [node, "--input-type=module", "-e", script], cwd=files, capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("fitted 2\n", "")


def test_a_renderer_without_webgl_2_is_told_once(browser: "Browser", tmp_path: Path) -> None:
    script = """const canvas = document.querySelector("canvas"), renderer = new THREE.WebGLRenderer({canvas});
const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(), a = createMesh(THREE), b = createMesh(THREE);
camera.position.z = 4;
scene.add(a, b);
for (let i = 0; i < 3; ++i) renderer.render(scene, camera);
window.shown = [a.visible, b.visible];"""
    library = f"<script>{three_js().read_text(encoding='utf-8')}</script>"
    path = tmp_path / "page.html"
    path.write_text(module_page(mplicits.Field(fitted_model((8, 16))), "<canvas></canvas>", script, library))
    page, lines = browser.new_page(), list[str]()
    listen(page, lines)
    page.goto(path.as_uri())
    page.wait_for_function("() => window.shown", timeout=PATIENCE)
    assert page.evaluate("shown") == [False, False]
    page.close()
    assert sum("createMesh needs a THREE.WebGLRenderer with WebGL 2" in line for line in lines) == 1
