"""The fixtures that several test files share, and the one option that rewrites golden files."""

import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from zopfli.zlib import compress

from mplicits.bake.registry import TARGETS
from mplicits.viewer.draw.context import Context
from support import needs
from support.browser import Visit, chromium, visit
from support.display import virtual_display
from support.needs import pytest_terminal_summary  # noqa: F401 (a hook)
from support.page_pictures import MODEL
from support.signals import usual_signals  # noqa: F401 (a fixture)
from support.viewer_fixture import open_viewer  # noqa: F401 (a fixture)

if TYPE_CHECKING:
    from playwright.sync_api import Browser

TESTS = Path(__file__).parent


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write the golden files; look at each before commit")
    parser.addoption(
        "--part", metavar="K/N", help="of the slow tests that open nothing that ships, run those of one file in N"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Let shaders compile as in the viewer, and give each of several workers one thread: they share the cores."""
    os.environ.setdefault("GALLIVM_PERF", "nopt")
    if config.getoption("numprocesses", None):
        os.environ.setdefault("OMP_NUM_THREADS", "1")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark tests with `needs.data`, and let the long files begin: short ones fill the cores at the end.

    Leaves out what --part does.
    """
    for item in items:
        if any("MPLICITS_DATA" in mark.kwargs.get("reason", "") for mark in item.iter_markers("skipif")):
            item.add_marker("data")
    if part := config.getoption("--part"):
        number, count = map(int, part.split("/"))
        left_out = [
            item
            for item in items
            if item.get_closest_marker("slow")
            and not item.path.is_relative_to(TESTS / "shipped")
            and (zlib.crc32(item.path.relative_to(TESTS).as_posix().encode()) - number) % count
        ]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in set(left_out)]
    long = {item.path for item in items if {"browser", "shipped"} & {*getattr(item, "fixturenames", ())}}
    items.sort(key=lambda item: item.path not in long)


@pytest.fixture(scope="session", autouse=True)
def quick_deflate() -> Iterator[None]:
    """Let zlib pack pages: Zopfli takes a second for each. See `zopfli`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("zopfli.zlib.compress", zlib.compress)
        yield


@pytest.fixture
def zopfli(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages as small as the package makes them."""
    monkeypatch.setattr("zopfli.zlib.compress", compress)


@pytest.fixture(scope="session")
def osmesa() -> Iterator[Context]:
    """A context of software OpenGL, which draws the same on every machine."""
    context = needs.context("osmesa")
    yield context
    context.release()


@pytest.fixture(scope="session")
def xvfb() -> Iterator[dict[str, str]]:
    """The environment of a process that may open windows, which appear on a display made for the tests."""
    with virtual_display() as environment:
        yield environment


@pytest.fixture(scope="session")
def browser() -> Iterator["Browser"]:
    """Headless Chromium with WebGL2 on the CPU, which draws the page without it: that takes a third less time."""
    with chromium("SwiftShader for WebGL") as browser:
        yield browser


@pytest.fixture(scope="session")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A web page of MODEL in Phong."""
    path = tmp_path_factory.mktemp("page") / "ball.html"
    path.write_text(TARGETS["html"](MODEL, shade="phong"))
    return path


@pytest.fixture(scope="module")
def opened(browser: "Browser", page_file: Path) -> Iterator[Visit]:
    """The page of MODEL, which the tests of a file share; each test closes its messages."""
    with visit(browser, page_file, has_touch=True) as visited:
        visited.still()
        yield visited
        assert visited.console == []
