"""A site with modules and model files whose answers a test may hold back, and with elements <mplicits-view>."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mplicits.model.model_file import save
from mplicits.web.module import baked
from support.browser import PATIENCE, listen
from support.fitted_model import fitted_model
from support.module_pages import WATCH
from support.moving_model import moving_model
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Route

BALL = '<script type="module" src="ball.js"></script>'
STYLE = "<style>mplicits-view { display: block; width: 48px; height: 48px; }</style>"
STARTED = "() => window.log"


class Site:
    """A site with the files of a folder; it holds back the files in `held`, and has none of `missing`."""

    def __init__(self, page: "Page", folder: Path, body: str) -> None:
        self.page, self.folder, self.body = page, folder, body
        self.held = dict[str, list["Route"]]()
        self.missing = set[str]()
        page.route("http://page.test/**", self._serve)

    def _serve(self, route: "Route") -> None:
        name = route.request.url.rpartition("/")[2]
        if name in self.held:
            self.held[name].append(route)
        elif not name:
            text = f"<!doctype html>{STYLE}{self.body}<script>{WATCH}</script>"
            route.fulfill(body=text, content_type="text/html")
        else:
            self._answer(route, name)

    def _answer(self, route: "Route", name: str) -> None:
        if name in self.missing:
            route.fulfill(status=404)
        else:
            route.fulfill(path=self.folder / name)

    def hold(self, name: str) -> None:
        """Hold back the answers to requests of a file."""
        self.held[name] = []

    def let(self, name: str) -> None:
        """Answer the requests of a file, also the later ones."""
        for route in self.held.pop(name):
            self._answer(route, name)

    def asked(self, name: str) -> None:
        """Wait until a file that is held is asked for."""
        while not self.held[name]:
            self.page.wait_for_timeout(20)

    def told(self, view: str, kind: str, times: int = 1) -> None:
        """Wait for an event of an element."""
        condition = "([id, kind, times]) => log.filter(([view, type]) => view === id && type === kind).length >= times"
        self.page.wait_for_function(condition, arg=[view, kind, times])

    def events(self, view: str) -> list[str]:
        """Return the kinds of events of an element until now, without those of its camera."""
        log = self.page.evaluate("log")
        return [kind for one, kind, _ in log if one == view and kind != "camera-change"]

    def label(self, view: str) -> Any:
        """Return what an element's canvas is called: its model's name."""
        return self.page.evaluate(
            "id => of(id).shadowRoot.querySelector('canvas:not(.still)').getAttribute('aria-label')", view
        )


@contextmanager
def site(
    browser: "Browser", folder: Path, body: str, script: str = "", lines: list[str] | None = None, **options: Any
) -> Iterator[Site]:
    """Open a page with elements.

    script: runs before the page's own. lines: expected on the console, in any order.
    options: further ones of Playwright's new_context.
    """
    context = browser.new_context(**{"viewport": {"width": 400, "height": 400}} | options)
    context.set_default_timeout(PATIENCE)
    page, console = context.new_page(), list[str]()
    listen(page, console)
    page.add_init_script(script)
    opened = Site(page, folder, body)
    page.goto("http://page.test/", wait_until="commit")
    yield opened
    context.close()
    assert sorted(console) == sorted(lines or [])


def write_files(folder: Path) -> Path:
    """Write modules and model files to a folder, and return it."""
    models = {"ball": fitted_model((8, 16)), "other": random_model((8, 0), name="other"), "moving": moving_model()}
    for name, model in models.items():
        save(model, folder / f"{name}.safetensors")
        if name != "moving":
            (folder / f"{name}.js").write_text(baked(model, poster=name == "other").text)
    return folder
