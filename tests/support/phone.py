"""A window of a phone's size in Chromium and in Firefox, for tests that use a page in the same way in both."""

import base64
import io
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from support.browser import PATIENCE, visit
from support.display import virtual_display
from support.firefox import Firefox, firefox

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SIZE = (390, 844)
"""CSS pixels."""
SHARE = 0.5
"""Pixels of a picture for each of them, along each axis: a phone has more, but a CPU draws them."""
PREFERENCES = {
    "layout.css.devPixelsPerPx": str(SHARE),
    "layout.css.prefers-color-scheme.content-override": 0,
    "ui.prefersReducedMotion": 1,
}
"""Preferences of Firefox: dark pages, and nothing moves by itself."""
_FRAME = """<!doctype html><style>iframe { position: fixed; inset: 0; width: 390px; height: 844px; border: 0; }</style>
<iframe src="NAME">"""

Picture = NDArray[np.int16]
"""(422, 195, 3), sRGB from 0 to 255, top row first."""


class Phone(Protocol):
    """A window with a page."""

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression in the page."""

    def until(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Press at a point, move, and let go."""

    def picture(self) -> Picture:
        """Return what the window shows."""


class _Chromium:
    def __init__(self, visited: Any) -> None:
        self._page, self.until = visited.page, visited.until

    def evaluate(self, expression: str) -> Any:
        return self._page.evaluate(f"() => ({expression})")

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        mouse = self._page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move(*end, steps=3)
        mouse.up()

    def picture(self) -> Picture:
        return _pixels(self._page.screenshot())


class _Firefox:
    """Firefox's windows are wider than phones: the page is in a frame."""

    def __init__(self, tab: Firefox) -> None:
        self._tab, self.evaluate, self.until = tab, tab.evaluate, tab.until

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        def move(point: tuple[int, int]) -> dict[str, Any]:
            return {"type": "pointerMove", "x": point[0], "y": point[1], "duration": 0}

        down, up = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}
        pointer = {"type": "pointer", "id": "mouse", "actions": [move(start), down, move(end), up]}
        self._tab.ask("WebDriver:PerformActions", {"actions": [pointer]})

    def picture(self) -> Picture:
        data = self._tab.ask("WebDriver:TakeScreenshot", {"full": False, "hash": False})["value"]
        width, height = (round(SHARE * side) for side in SIZE)
        return _pixels(base64.b64decode(data))[:height, :width]


def _pixels(data: bytes) -> Picture:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), np.int16)


@contextmanager
def phone_chromium(browser: "Browser", path: Path) -> Iterator[Phone]:
    """Open a page in Chromium, where a phone's touch and viewport are pretended."""
    more: dict[str, Any] = {"has_touch": True, "is_mobile": True, "reduced_motion": "reduce"}
    with visit(browser, path, SIZE, SHARE, **more) as visited:
        visited.page.set_default_timeout(PATIENCE)
        yield _Chromium(visited)
        assert visited.console == []


@contextmanager
def phone_firefox(path: Path, profile: Path) -> Iterator[Phone]:
    """Open a page in Firefox. profile: an empty folder."""
    host = path.with_name(f"host-of-{path.name}")
    host.write_text(_FRAME.replace("NAME", path.name))
    with ExitStack() as stack:
        environment = stack.enter_context(virtual_display("800x1000"))
        tab = stack.enter_context(firefox(profile, environment, PREFERENCES))
        tab.ask("WebDriver:SetWindowRect", {"x": 0, "y": 0, "width": 800, "height": 1000})
        tab.load(host.as_uri())
        tab.ask("WebDriver:SwitchToFrame", {"id": 0})
        yield _Firefox(tab)
