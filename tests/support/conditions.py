"""Bad conditions of a visitor's browser, for pages in Chromium."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from support.browser import launched
from support.tabs import ChromiumTab, chromium_tab

if TYPE_CHECKING:
    from playwright.sync_api import Browser

_GET = """for (const {prototype} of [HTMLCanvasElement, self.OffscreenCanvas].filter(Boolean)) {
    const {getContext} = prototype;
    prototype.getContext = function (kind, ...more) {
        return kind === "webgl2" ? null : getContext.call(this, kind, ...more);
    };
}"""
_REFUSE = """{
    const {prototype} = WebGL2RenderingContext, {shaderSource} = prototype;
    prototype.shaderSource = function (shader, text) { shaderSource.call(this, shader, text + "\\nrefused"); };
}"""
_LOSE = """{
    const {prototype} = WebGL2RenderingContext, {drawArrays} = prototype, key = "contexts lost";
    prototype.drawArrays = function (...numbers) {
        drawArrays.apply(this, numbers);
        const lost = Number(sessionStorage.getItem(key));
        if (lost === 3 || this.isContextLost()) return;
        sessionStorage.setItem(key, String(lost + 1));
        const extension = this.getExtension("WEBGL_lose_context");
        const restore = (event) => setTimeout(() => event.defaultPrevented && extension.restoreContext(), 20);
        this.canvas.addEventListener("webglcontextlost", restore, {once: true});
        extension.loseContext();
    };
}"""


PHONE = (390, 844)
"""CSS pixels of a phone."""


@dataclass(frozen=True)
class Condition:
    """What a browser lacks, or how it is used."""

    says: str = ""
    """A regular expression of the line that a page shows, in any case; empty where it draws as always."""
    script: str = ""
    """JavaScript that runs before the page's own."""
    slower: int = 1
    """How many times slower the page's processor is."""
    flags: tuple[str, ...] = ()
    """Flags of Chromium."""
    size: tuple[int, int] | None = None
    """CSS pixels of the window; None for those of the test."""
    options: dict[str, Any] = field(default_factory=dict)
    """Options of `support.browser.visit`."""


CONDITIONS = {
    "slow": Condition(slower=6),
    "phone": Condition(size=PHONE, options={"has_touch": True, "is_mobile": True}),
    "no-webgl2": Condition(r"WebGL ?2", script=_GET),
    "no-simd": Condition(flags=("--js-flags=--no-enable-sse4-1",)),
    "no-decompression": Condition("unpack|DecompressionStream", script="delete globalThis.DecompressionStream;"),
    "refusing-driver": Condition("driver|compiler|shader", script=_REFUSE),
    "lost-contexts": Condition("driver", script=_LOSE),
}
"""Name -> condition."""
SMALLEST = 12
"""Smallest letters of a line, CSS pixels."""
_LETTERS = """(pattern) => {
    const holds = (node) => new RegExp(pattern, "i").test(node.textContent) && node.checkVisibility();
    const within = (node) => [node, ...[...node.children, ...node.shadowRoot?.children ?? []].flatMap(within)];
    const found = within(document.body).filter(holds).at(-1);
    return found ? parseFloat(getComputedStyle(found).fontSize) : null;
}"""
"""The size of the letters of the innermost visible element whose text matches; null if there is none."""


@contextmanager
def conditioned(
    browser: "Browser", path: Path | str, condition: Condition, size: tuple[int, int], share: float
) -> Iterator[ChromiumTab]:
    """Open a page in a condition. Afterwards its console has the condition's line at most, and nothing is too wide.

    size, share: of `support.tabs.Tab`.
    """
    if condition.flags:
        other = launched(browser.browser_type, "SwiftShader for WebGL", condition.flags)
        with conditioned(other, path, replace(condition, flags=()), size, share) as tab:
            yield tab
        other.close()
        return
    options = {"script": condition.script, "offline": isinstance(path, Path)} | condition.options
    with chromium_tab(browser, path, condition.size or size, share, **options) as tab:
        if condition.slower > 1:
            session = tab.visit.page.context.new_cdp_session(tab.visit.page)
            session.send("Emulation.setCPUThrottlingRate", {"rate": condition.slower})
        yield tab
        said = re.compile(condition.says or "(?!)", re.IGNORECASE)
        assert [line for line in tab.console() if not said.search(line)] == []
        assert tab.evaluate("document.documentElement.scrollWidth") <= tab.size[0]


def check_line(tab: ChromiumTab, pattern: str) -> None:
    """Wait for a visible line that matches, in letters that a person can read."""
    tab.visit.page.wait_for_function(f"(pattern) => ({_LETTERS})(pattern) !== null", arg=pattern)
    assert tab.visit.page.evaluate(_LETTERS, pattern) >= SMALLEST
