"""The notebook in examples/ runs, its models show themselves, and a page made of it by nbconvert keeps them."""

import base64
import importlib.util
import io
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

from support.browser import PATIENCE
from support.paths import ROOT

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Frame, Page

pytestmark = pytest.mark.slow
TOUR = ROOT / "examples" / "tour.ipynb"
MOST = 100_000
"""Bytes of the notebook in the repository."""
DRAWN = "() => 'drawn' in document.documentElement.dataset"


@pytest.fixture(scope="module")
def tour(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """The notebook after all its cells have run: its file, and what is in it."""
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed (pip: nbclient)")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(TOUR, as_version=4)
    folder = tmp_path_factory.mktemp("tour")
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    nbformat.write(notebook, folder / "tour.ipynb")
    return folder / "tour.ipynb", notebook


def test_every_cell_shows_something(tour: tuple[Path, Any]) -> None:
    assert TOUR.stat().st_size < MOST
    cells = [cell for cell in tour[1].cells if cell.cell_type == "code"]
    shown = [{key for output in cell.outputs for key in output.get("data", {})} for cell in cells]
    assert len(cells) >= 5
    assert {"image/png", "text/html", "text/plain"} <= shown[0]
    assert not [output for cell in cells for output in cell.outputs if output.output_type == "error"]
    assert "iframe" not in TOUR.read_text(encoding="utf-8"), "what runs is not kept in the repository"


def test_a_training_shows_a_bar_and_a_picture(tour: tuple[Path, Any]) -> None:
    last = [cell for cell in tour[1].cells if cell.cell_type == "code"][-1]
    data = [output.data for output in last.outputs if "data" in output]
    assert len([each for each in data if "application/vnd.jupyter.widget-view+json" in each]) == 3, (
        "two levels, a texture"
    )
    (picture,) = [each["image/png"] for each in data if "image/png" in each]
    assert "> 16x1" in next(each["text/plain"] for each in data if "image/png" in each), "the last level's"
    alpha = np.asarray(Image.open(io.BytesIO(base64.b64decode(picture))))[..., 3]
    assert 0.1 < (alpha > 0).mean() < 0.9


def live(page: "Page") -> "Frame":
    """Scroll to the first model on a page, and wait until its page has drawn."""
    element = page.wait_for_selector("iframe[srcdoc]", state="attached", timeout=PATIENCE)
    assert element is not None
    element.scroll_into_view_if_needed()
    outer = element.content_frame()
    assert outer is not None
    outer.wait_for_selector("iframe", state="attached", timeout=PATIENCE)
    inner = outer.child_frames[0]
    inner.wait_for_function(DRAWN, timeout=PATIENCE)
    return inner


def test_a_page_by_nbconvert_keeps_picture_and_model(tour: tuple[Path, Any], browser: "Browser") -> None:
    nbconvert = pytest.importorskip("nbconvert", reason="nbconvert is not installed (pip: nbconvert)")
    text, _ = nbconvert.HTMLExporter().from_notebook_node(tour[1])
    path = tour[0].with_suffix(".html")
    path.write_text(text, encoding="utf-8")
    assert text.count("data:image/png;base64,") >= 3
    context = browser.new_context(offline=True, device_scale_factor=0.2, viewport={"width": 900, "height": 700})
    page = context.new_page()
    page.goto(path.as_uri())
    assert live(page).evaluate("() => document.title").startswith("spot")
    context.close()


@contextmanager
def jupyterlab(folder: Path) -> Iterator[str]:
    """Serve a folder by JupyterLab: its address."""
    if importlib.util.find_spec("jupyterlab") is None:
        pytest.skip("JupyterLab is not installed (pip: jupyterlab)")
    settings = ["--no-browser", "--allow-root", "--port=0", "--IdentityProvider.token=", "--ServerApp.password="]
    environment = os.environ | {
        "JUPYTER_CONFIG_DIR": str(folder / ".config"),
        "JUPYTER_DATA_DIR": str(folder / ".data"),
    }
    command = [sys.executable, "-m", "jupyterlab", *settings]
    with subprocess.Popen(command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        try:
            line = next(line for line in server.stderr if "http://localhost:" in line)
            yield line[line.index("http://") :].split("/lab")[0].strip()
        finally:
            server.terminate()
            server.stderr.close()


def test_a_model_lives_in_jupyterlab(tour: tuple[Path, Any], browser: "Browser", tmp_path: Path) -> None:
    shutil.copy(TOUR, tmp_path)
    with jupyterlab(tmp_path) as address:
        context = browser.new_context(device_scale_factor=0.3, viewport={"width": 1000, "height": 800})
        page = context.new_page()
        page.goto(f"{address}/lab/tree/tour.ipynb", timeout=PATIENCE)
        page.click(".jp-Notebook .jp-CodeCell .cm-content >> nth=0", timeout=PATIENCE)
        page.keyboard.press("Shift+Enter")
        assert live(page).evaluate("() => document.title").startswith("spot")
        page.screenshot(path=tmp_path / "lab.png", timeout=PATIENCE)
        context.close()
