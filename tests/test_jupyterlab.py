"""A notebook of twenty models in JupyterLab, in Chromium, and as nbconvert's page: trusted or not, all are seen."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from mplicits.model.model_file import save
from support.browser import PATIENCE
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = pytest.mark.slow
COUNT = 20
"""Models on one page: more than the WebGL contexts that a browser keeps."""
MOST = 4
"""Of them in sight at once, or just leaving it."""
NAME = "twenty.ipynb"
PANEL = ".jp-WindowedPanel-outer"
"""What scrolls in JupyterLab."""


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Twenty cells, run by a kernel, that show a model each, every one another."""
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed (pip: nbclient)")
    folder = tmp_path_factory.mktemp("models")
    for i in range(COUNT):
        save(random_model((4, 0), name=f"number {i}", seed=i), folder / f"{i}.safetensors")
    lines = [f'mplicits.load("{i}.safetensors")' for i in range(COUNT)]
    lines[0] = f"import mplicits\n{lines[0]}"
    made = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(line) for line in lines])
    nbclient.NotebookClient(made, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    assert len({cell.outputs[0].data["image/png"] for cell in made.cells}) == COUNT
    return made


@pytest.fixture(scope="module")
def lab(notebook: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """JupyterLab with the notebook: its address, and the folder where it keeps what it trusts."""
    pytest.importorskip("jupyterlab", reason="JupyterLab is not installed (pip: jupyterlab)")
    nbformat = pytest.importorskip("nbformat")
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
        while not (found := list(runtime.glob("jpserver-*.json"))):
            assert server.poll() is None, (folder / "log").read_text()
            assert time.monotonic() - began < 60
            time.sleep(0.1)
        time.sleep(0.5)  # until the file is written to its end
        yield json.loads(found[0].read_text())["url"], folder
    finally:
        server.terminate()
        server.wait()


@pytest.fixture
def opened(browser: "Browser", lab: tuple[str, Path]) -> Iterator[tuple["Page", list[str]]]:
    """A tab in a small window, and what frames and scripts in it say when something is wrong."""
    context = browser.new_context(device_scale_factor=0.2, viewport={"width": 1000, "height": 900})
    page, said = context.new_page(), list[str]()
    page.on("console", lambda message: said.append(message.text) if "srcdoc" in message.location["url"] else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    yield page, said
    context.close()


def cells_seen(page: "Page", selector: str) -> None:
    """Wait until JupyterLab has laid out the first cells."""
    page.wait_for_selector(f".jp-OutputArea-output {selector}", timeout=120_000)


def answers(page: "Page", question: str) -> list[Any]:
    """Ask all frames of a page a script. JupyterLab takes frames out of the page at any time: they do not answer."""
    from playwright.sync_api import Error

    given = []
    for frame in page.frames:
        try:
            given.append(frame.evaluate(question))
        except Error as error:
            if "detached" not in error.message:
                raise
    return given


def canvases(page: "Page") -> int:
    """Count the canvases of all frames of a page: the WebGL contexts that it asks the browser for."""
    return sum(answers(page, "() => document.querySelectorAll('canvas').length"))


def test_a_notebook_by_somebody_else_shows_pictures(opened: tuple["Page", list[str]], lab: tuple[str, Path]) -> None:
    page, said = opened
    page.goto(f"{lab[0]}lab/tree/{NAME}")
    cells_seen(page, "img")
    widths = page.evaluate("() => [...document.querySelectorAll('.jp-OutputArea-output img')].map(i => i.naturalWidth)")
    assert widths
    assert set(widths) == {320}
    assert page.query_selector(".jp-OutputArea-output iframe") is None, "nothing that is not trusted runs"
    assert said == []


def test_twenty_models_in_jupyterlab(opened: tuple["Page", list[str]], lab: tuple[str, Path], notebook: Any) -> None:
    notary = pytest.importorskip("nbformat.sign").NotebookNotary(data_dir=str(lab[1]))
    notary.sign(notebook)
    notary.store.close()
    page, said = opened
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
    assert 1 <= max(counts) <= MOST
    drawn = 0
    for _ in range(PATIENCE // 1000):
        if drawn := sum(answers(page, "() => 'drawn' in document.documentElement.dataset")):
            break
        page.wait_for_timeout(1000)
    assert drawn, "after all the scrolling, what is in sight is drawn"
    assert said == []


def test_nbconvert_s_page_is_live(browser: "Browser", notebook: Any, tmp_path: Path) -> None:
    nbconvert = pytest.importorskip("nbconvert", reason="nbconvert is not installed (pip: nbconvert)")
    text, _ = nbconvert.HTMLExporter().from_notebook_node(notebook)
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    context = browser.new_context(offline=True, device_scale_factor=0.2, viewport={"width": 900, "height": 600})
    page, said = context.new_page(), list[str]()
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto((tmp_path / "page.html").as_uri(), wait_until="domcontentloaded")
    outer = page.wait_for_selector("iframe")
    assert outer is not None
    frame = outer.content_frame()
    assert frame is not None
    frame.wait_for_selector("iframe")
    frame.child_frames[0].wait_for_function("() => 'drawn' in document.documentElement.dataset", timeout=PATIENCE)
    assert 1 <= canvases(page) <= MOST
    assert page.evaluate("() => document.querySelectorAll('img[alt^=\"<mplicits\"]').length") == COUNT
    context.close()
    assert said == []


def test_what_cannot_run_pages_keeps_the_picture(notebook: Any) -> None:
    nbconvert = pytest.importorskip("nbconvert", reason="nbconvert is not installed (pip: nbconvert)")
    text, kept = nbconvert.LatexExporter().from_notebook_node(notebook)
    pictures = [data for name, data in kept["outputs"].items() if name.endswith(".png")]
    assert len(pictures) == COUNT
    assert all(data.startswith(b"\x89PNG") for data in pictures)
    assert "srcdoc" not in text
