"""A notebook of twenty models in JupyterLab, trusted and untrusted, and as a page and LaTeX from nbconvert."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from mplicits.model.model_file import save
from support import needs
from support.browser import PATIENCE, REMARK
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser, ConsoleMessage, Page

pytestmark = pytest.mark.slow
COUNT = 8
"""Models in the notebook: twice as many as may be live."""
MOST = 4
"""Largest number of live models: those in sight or just leaving it."""
NAME = "models.ipynb"
PANEL = ".jp-WindowedPanel-outer"
"""The element that scrolls in JupyterLab."""


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """An executed notebook of cells with a different model each."""
    nbformat = needs.package("nbformat")
    nbclient = needs.package("nbclient")
    folder = tmp_path_factory.mktemp("models")
    for i in range(COUNT):
        save(random_model((4, 0), name=f"number {i}", seed=i), folder / f"{i}.safetensors")
    lines = [f'mplicits.load("{i}.safetensors")' for i in range(COUNT)]
    lines[0] = f"import mplicits\n{lines[0]}"
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(line) for line in lines])
    nbclient.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    assert len({cell.outputs[0].data["image/png"] for cell in book.cells}) == COUNT
    return book


@pytest.fixture(scope="module")
def lab(notebook: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """JupyterLab with the notebook: its address, and the folder of its signatures."""
    needs.package("jupyterlab")
    nbformat = needs.package("nbformat")
    folder = tmp_path_factory.mktemp("lab")
    work, runtime = folder / "work", folder / "runtime"
    work.mkdir()
    nbformat.write(notebook, work / NAME)
    places = {"JUPYTER_RUNTIME_DIR": runtime, "JUPYTER_CONFIG_DIR": folder / "config", "JUPYTER_DATA_DIR": folder}
    places |= {"JUPYTERLAB_SETTINGS_DIR": folder / "settings", "JUPYTERLAB_WORKSPACES_DIR": folder / "workspaces"}
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--port=0"]
    command += ["--IdentityProvider.token=", f"--ServerApp.root_dir={work}"]
    with (folder / "log").open("w") as log, pytest.MonkeyPatch.context() as patch:
        for name, place in places.items():
            patch.setenv(name, str(place))
        server = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        began = time.monotonic()
        while not (found := [path.read_text() for path in runtime.glob("jpserver-*.json")]) or "}" not in found[0]:
            assert server.poll() is None, (folder / "log").read_text()
            assert time.monotonic() - began < 300
            time.sleep(0.1)
        yield json.loads(found[0])["url"], folder
    finally:
        server.terminate()
        server.wait()


def told_by_frame(message: "ConsoleMessage") -> bool:
    """Whether a line of the console is of a model's frame, and no remark of the driver about speed."""
    return "srcdoc" in message.location["url"] and REMARK not in message.text


@pytest.fixture
def opened(browser: "Browser", lab: tuple[str, Path]) -> Iterator[tuple["Page", list[str]]]:
    """A tab in a small window, and the console lines of its frames and scripts."""
    context = browser.new_context(device_scale_factor=0.2, viewport={"width": 1000, "height": 900})
    context.set_default_timeout(PATIENCE)
    page, console = context.new_page(), list[str]()
    page.on("console", lambda message: console.append(message.text) if told_by_frame(message) else None)
    page.on("pageerror", lambda error: console.append(str(error)))
    yield page, console
    context.close()


def cells_seen(page: "Page", selector: str) -> None:
    """Wait until JupyterLab has laid out the first cells."""
    page.wait_for_selector(f".jp-OutputArea-output {selector}")


def answers(page: "Page", question: str) -> list[Any]:
    """Run a script in all frames of a page, except frames that JupyterLab detaches meanwhile."""
    from playwright.sync_api import Error

    results = []
    for frame in page.frames:
        try:
            results.append(frame.evaluate(question))
        except Error as error:
            if "detached" not in error.message:
                raise
    return results


def canvases(page: "Page") -> int:
    """Count the canvases, hence WebGL contexts, of all frames of a page."""
    return sum(answers(page, "() => document.querySelectorAll('canvas').length"))


def test_an_untrusted_notebook_shows_pictures(opened: tuple["Page", list[str]], lab: tuple[str, Path]) -> None:
    page, console = opened
    page.goto(f"{lab[0]}lab/tree/{NAME}")
    cells_seen(page, "img")
    widths = page.evaluate("() => [...document.querySelectorAll('.jp-OutputArea-output img')].map(i => i.naturalWidth)")
    assert widths
    assert set(widths) == {320}
    assert page.query_selector(".jp-OutputArea-output iframe") is None, "no untrusted frame runs"
    assert console == []


def test_models_in_jupyterlab(opened: tuple["Page", list[str]], lab: tuple[str, Path], notebook: Any) -> None:
    notary = needs.package("nbformat.sign").NotebookNotary(data_dir=str(lab[1]))
    notary.sign(notebook)
    notary.store.close()
    page, console = opened
    page.goto(f"{lab[0]}lab/tree/{NAME}")
    cells_seen(page, "iframe")
    counts = []
    for share in (0, 0.3, 0.6, 1, 0):
        page.evaluate(
            f"share => {{ const panel = document.querySelector('{PANEL}');"
            " panel.scrollTop = share * (panel.scrollHeight - panel.clientHeight); }",
            share,
        )
        for _ in range(20):
            page.wait_for_timeout(100)
            counts.append(canvases(page))
    drawn = 0
    for _ in range(PATIENCE // 1000):
        if drawn := sum(answers(page, "() => 'drawn' in document.documentElement.dataset")):
            break
        page.wait_for_timeout(1000)
    assert drawn, "after scrolling, the visible models are drawn"
    assert 1 <= max(*counts, canvases(page)) <= MOST
    assert console == []


def test_nbconvert_s_page_is_live(browser: "Browser", notebook: Any, tmp_path: Path) -> None:
    nbconvert = needs.package("nbconvert")
    text, _ = nbconvert.HTMLExporter().from_notebook_node(notebook)
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    context = browser.new_context(offline=True, device_scale_factor=0.2, viewport={"width": 900, "height": 600})
    context.set_default_timeout(PATIENCE)
    page, console = context.new_page(), list[str]()
    page.on("pageerror", lambda error: console.append(str(error)))
    page.goto((tmp_path / "page.html").as_uri(), wait_until="domcontentloaded")
    outer = page.wait_for_selector("iframe")
    assert outer is not None
    frame = outer.content_frame()
    assert frame is not None
    frame.wait_for_selector("iframe")
    frame.child_frames[0].wait_for_function("() => 'drawn' in document.documentElement.dataset")
    assert 1 <= canvases(page) <= MOST
    assert page.evaluate("() => document.querySelectorAll('img[alt^=\"<mplicits\"]').length") == COUNT
    context.close()
    assert console == []


def test_latex_contains_the_pictures(notebook: Any) -> None:
    nbconvert = needs.package("nbconvert")
    text, kept = nbconvert.LatexExporter().from_notebook_node(notebook)
    pictures = [data for name, data in kept["outputs"].items() if name.endswith(".png")]
    assert len(pictures) == COUNT
    assert all(data.startswith(b"\x89PNG") for data in pictures)
    assert "srcdoc" not in text
