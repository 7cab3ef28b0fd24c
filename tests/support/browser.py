"""Chromium for tests and measurements of the page: WebGL2, WebGPU on the CPU, no network, a record of the console."""

import io
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from support import needs

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserType, Page

DRIVERS = {"SwiftShader": "swiftshader", "SwiftShader for WebGL": "swiftshader-webgl", "llvmpipe": "gl-egl"}
"""Name of a software GL -> ANGLE's name for the back end that reaches it.

The second draws WebGL alone, the others the whole page.
"""
PATIENCE = 300_000
"""Timeout of all that a test waits for, milliseconds: as long as a busy machine takes."""
REMARK = "GL Driver Message (OpenGL, Performance"
_DROP = """([bytes, name]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([new Uint8Array(bytes)], name));
    for (const kind of ["dragover", "drop"])
        document.body.dispatchEvent(new DragEvent(kind, {dataTransfer: transfer, bubbles: true, cancelable: true}));
}"""
_LOSE = """() => {
    window.loss ??= document.getElementById("view").getContext("webgl2").getExtension("WEBGL_lose_context");
    window.loss.loseContext();
}"""
_RESTORE = """() => new Promise((done) => {
    document.getElementById("view").addEventListener("webglcontextrestored", () => done(), {once: true});
    setTimeout(() => window.loss.restoreContext(), 50);
})"""
_FOLLOW = """hash => new Promise(done => {
    if (location.hash === hash) return done();
    addEventListener("hashchange", () => done(), {once: true});
    location.hash = hash;
})"""


@contextmanager
def chromium(driver: str = "SwiftShader") -> Iterator["Browser"]:
    """Start Debian's Chromium, headless, on one of DRIVERS. Skips the test where it or Playwright is not installed."""
    sync_api = needs.package("playwright.sync_api")
    needs.program("Chromium")
    with sync_api.sync_playwright() as playwright:
        browser = launched(playwright.chromium, driver)
        yield browser
        browser.close()


def launched(kind: "BrowserType", driver: str, flags: Sequence[str] = ()) -> "Browser":
    """Start Chromium. driver: one of DRIVERS. flags: further ones."""
    flags = [*flags, "--use-gl=angle", f"--use-angle={DRIVERS[driver]}"]
    flags += ["--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    flags += ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]
    environment: dict[str, str | float | bool] = {**os.environ, "EGL_PLATFORM": "surfaceless"}
    return kind.launch(executable_path=needs.program("Chromium"), args=flags, env=environment, timeout=PATIENCE)


_SHARE = "document.getElementById('view').width / document.getElementById('view').clientWidth"
"""Drawn pixels of the canvas for each pixel of CSS."""


@dataclass
class Visit:
    """An open page."""

    page: "Page"
    console: list[str] = field(default_factory=list)
    """Lines on the console, uncaught errors included."""

    def until(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""
        # As a function, because the page's policy forbids eval().
        self.page.wait_for_function(f"() => {condition}")

    def still(self) -> None:
        """Wait until the picture is refined and nothing more is drawn."""
        self.until("document.documentElement.dataset.state === 'still'")

    def root(self, key: str) -> str | None:
        """Return a data attribute of the root element: state, storage, error or tone; None if it is missing."""
        value = self.page.evaluate("key => document.documentElement.dataset[key] ?? null", key)
        assert value is None or isinstance(value, str)
        return value

    def unfold(self) -> None:
        """Unfold the panel."""
        if not self.page.is_visible("#panel"):
            self.page.click("#fold")

    def fold(self) -> None:
        """Fold the panel, and wait until the canvas has the pixels of the whole window."""
        if self.page.is_visible("#panel"):
            self.page.click("#fold")
            self.until(f"Math.abs({_SHARE} - devicePixelRatio) < 0.01")

    def drop(self, data: bytes, name: str) -> None:
        """Drop a file on the page."""
        self.page.evaluate(_DROP, [list(data), name])

    def lose_context(self) -> None:
        """Lose the context of the canvas."""
        self.page.evaluate(_LOSE)

    def restore_context(self) -> None:
        """Restore the lost context."""
        self.page.evaluate(_RESTORE)

    def violations(self) -> list[str]:
        """Return the violations that axe-core finds in the current page, including its best practices."""
        axe = needs.package("axe_playwright_python.sync_playwright")
        found: list[dict[str, Any]] = axe.Axe().run(self.page).response["violations"]
        return [f"{one['id']}: {node['html']}" for one in found for node in one["nodes"]]

    def message(self) -> str:
        """Return the visible message, or an empty text."""
        return self.page.inner_text("#message p") if self.page.is_visible("#message") else ""

    def saved(self) -> NDArray[np.uint8]:
        """Return the picture from "Save PNG", (H, W, 3)."""
        with self.page.expect_download() as download:
            self.page.keyboard.press("s")
        return np.asarray(Image.open(io.BytesIO(Path(download.value.path()).read_bytes())).convert("RGB"))

    def follow(self, hash_: str) -> None:
        """Set the URL's hash, including `#`, and wait for the event."""
        self.page.evaluate(_FOLLOW, hash_)

    def camera(self) -> dict[str, str]:
        """Return the keys and values in the URL's hash."""
        pairs = self.page.evaluate("() => location.hash.slice(1)").split("&")
        return dict(pair.split("=") for pair in pairs if pair)


def held_compilers(condition: str) -> str:
    """Return a script for `visit`: compilers do not finish while a JavaScript expression is true."""
    return f"""{{
        const {{prototype}} = WebGL2RenderingContext, {{getProgramParameter, getSyncParameter}} = prototype;
        const COMPLETION_STATUS_KHR = 0x91B1, isHeld = () => {condition};
        prototype.getProgramParameter = function (program, name) {{
            return !(isHeld() && name === COMPLETION_STATUS_KHR) && getProgramParameter.call(this, program, name);
        }};
        prototype.getSyncParameter = function (sync, name) {{ // without KHR_parallel_shader_compile
            return isHeld() ? this.UNSIGNALED : getSyncParameter.call(this, sync, name);
        }};
    }}"""


def listen(page: "Page", lines: list[str]) -> None:
    """Record the lines on a page's console, uncaught errors included.

    Without the driver's remarks about speed: software GL may stall where a page reads pixels.
    """
    page.on("console", lambda message: None if REMARK in message.text else lines.append(message.text))
    page.on("pageerror", lambda error: lines.append(str(error)))


def address(page: Path | str) -> str:
    """Return the address of a page. page: its file or its address."""
    return page if isinstance(page, str) else page.absolute().as_uri()


@contextmanager
def visit(
    browser: "Browser",
    path: Path | str,
    size: tuple[int, int] = (640, 640),
    share: float = 0.2,
    script: str = "",
    hash_: str = "",
    **options: Any,
) -> Iterator[Visit]:
    """Open the file `path`, or an address, without a network.

    size: of the window, CSS pixels; share: device pixels per CSS pixel; script: JavaScript that runs before the page's
    own; hash_: of the URL, including `#`; options: further options of Playwright's new_context.
    """
    window: dict[str, Any] = {"viewport": {"width": size[0], "height": size[1]}, "color_scheme": "dark"}
    context = browser.new_context(device_scale_factor=share, **{"offline": True} | window | options)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    visited = Visit(page)
    listen(page, visited.console)
    if script:
        page.add_init_script(script)
    page.goto(address(path) + hash_)
    yield visited
    context.close()
