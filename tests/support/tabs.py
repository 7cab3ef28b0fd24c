"""A page in a tab of Chromium or of Firefox, which a test uses in the same way in both."""

import base64
import io
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from support.browser import Visit, visit
from support.display import virtual_display
from support.firefox import Firefox, firefox

if TYPE_CHECKING:
    from playwright.sync_api import Browser

Picture = NDArray[np.int16]
"""(H, W, 3), sRGB from 0 to 255, top row first."""
QUIET = {"reduced_motion": "reduce"}
"""Options of `visit`: nothing moves by itself."""
PREFERENCES = {
    "layout.css.prefers-color-scheme.content-override": 0,
    "ui.prefersReducedMotion": 1,
    "browser.dom.window.dump.enabled": True,
    "devtools.console.stdout.content": True,
}
"""Preferences of Firefox: dark pages, nothing moves by itself, and the console is printed."""
FRAME = "<!doctype html><style>iframe { position: fixed; inset: 0; width: %dpx; height: %dpx; border: 0 }</style>"
TROUBLE = re.compile(r"(?m)^(?:JavaScript error: (?:file|http)|console\.(?:warn|error)(?!: RSLoader)).*$")
"""A line that Firefox prints of an uncaught error, a warning or an error on the console, without its own loader's."""


class Tab(Protocol):
    """A tab with a page. `size`: of the page, CSS pixels; `share`: pixels of a picture for each, along each axis."""

    size: tuple[int, int]
    share: float

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression in the page."""

    def until(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Press at a point, CSS pixels, move, and let go."""

    def picture(self) -> Picture:
        """Return what the tab shows."""

    def console(self) -> list[str]:
        """Return the errors and warnings so far."""


class ChromiumTab:
    """A tab of Chromium."""

    def __init__(self, visited: Visit, size: tuple[int, int], share: float) -> None:
        self.size, self.share, self.visit, self._page, self.until = size, share, visited, visited.page, visited.until

    def evaluate(self, expression: str) -> Any:
        return self._page.evaluate(f"() => ({expression})")

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        mouse = self._page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move(*end, steps=3)
        mouse.up()

    def picture(self) -> Picture:
        return pixels(self._page.screenshot())

    def console(self) -> list[str]:
        return self.visit.console


class FirefoxTab:
    """A tab of Firefox, whose windows are wider than phones: the page is in a frame."""

    def __init__(self, tab: Firefox, printed: Path, size: tuple[int, int], share: float) -> None:
        self.size, self.share, self._tab, self._printed = size, share, tab, printed
        self.evaluate, self.until = tab.evaluate, tab.until

    def open(self, path: Path) -> None:
        """Open a page."""
        host = self._printed.with_name("host.html")
        host.write_text(framed(path.absolute().as_uri(), self.size), encoding="utf-8")
        self.enter(host.as_uri())

    def enter(self, host: str) -> None:
        """Open the address of a page with the frame of `framed`, and go into the frame."""
        self._printed.write_text("")
        self._tab.ask("WebDriver:SwitchToFrame", {"id": None})
        self._tab.load(host)
        self._tab.ask("WebDriver:SwitchToFrame", {"id": 0})

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        def move(point: tuple[int, int]) -> dict[str, Any]:
            return {"type": "pointerMove", "x": point[0], "y": point[1], "duration": 0}

        down, up = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}
        pointer = {"type": "pointer", "id": "mouse", "actions": [move(start), down, move(end), up]}
        self._tab.ask("WebDriver:PerformActions", {"actions": [pointer]})

    def picture(self) -> Picture:
        data = self._tab.ask("WebDriver:TakeScreenshot", {"full": False, "hash": False})["value"]
        width, height = (round(self.share * side) for side in self.size)
        return pixels(base64.b64decode(data))[:height, :width]

    def console(self) -> list[str]:
        return TROUBLE.findall(self._printed.read_text(errors="replace"))


def framed(address: str, size: tuple[int, int]) -> str:
    """Return a page with another page in a frame. size: of the frame, CSS pixels."""
    return FRAME % size + f'<iframe src="{address}"></iframe>'


def pixels(data: bytes) -> Picture:
    """Decode a PNG."""
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), np.int16)


def steady(tab: Tab) -> Picture:
    """Return the picture once it changes no more."""
    before = tab.picture()
    while True:
        tab.until("new Promise((resolve) => setTimeout(() => resolve(true), 500))")
        after = tab.picture()
        if np.array_equal(before, after):
            return after
        before = after


@contextmanager
def chromium_tab(
    browser: "Browser", path: Path | str, size: tuple[int, int], share: float, **more: Any
) -> Iterator[ChromiumTab]:
    """Open a page. path: its file or its address; more: options of `visit`."""
    with visit(browser, path, size, share, **QUIET | more) as visited:
        yield ChromiumTab(visited, size, share)


@contextmanager
def firefox_tab(folder: Path, size: tuple[int, int], share: float) -> Iterator[FirefoxTab]:
    """Start Firefox. folder: an empty one. Skips the test where Firefox or Xvfb is not installed."""
    with ExitStack() as stack:
        environment = stack.enter_context(virtual_display("1000x1000"))
        more = PREFERENCES | {"layout.css.devPixelsPerPx": str(share)}
        (profile := folder / "profile").mkdir()
        tab = stack.enter_context(firefox(profile, environment, more, printed=folder / "printed.txt"))
        tab.ask("WebDriver:SetWindowRect", {"x": 0, "y": 0, "width": 1000, "height": 1000})
        yield FirefoxTab(tab, folder / "printed.txt", size, share)
