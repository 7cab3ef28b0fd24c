"""The notebook in examples/ runs and shows its models and its training."""

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from support import needs
from support.paths import ROOT

pytestmark = pytest.mark.slow
TOUR = ROOT / "examples" / "tour.ipynb"
LARGEST = 100_000
"""Largest size of the notebook in the repository, bytes."""


@pytest.fixture(scope="module")
def tour(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """The notebook after all cells ran: its file and its content."""
    nbclient = needs.package("nbclient")
    nbformat = needs.package("nbformat")
    notebook = nbformat.read(TOUR, as_version=4)
    folder = tmp_path_factory.mktemp("tour")
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    nbformat.write(notebook, folder / "tour.ipynb")
    return folder / "tour.ipynb", notebook


def test_cells_show_models_and_no_errors(tour: tuple[Path, Any]) -> None:
    assert TOUR.stat().st_size < LARGEST
    cells = [cell for cell in tour[1].cells if cell.cell_type == "code"]
    kinds = [{key for output in cell.outputs for key in output.get("data", {})} for cell in cells]
    assert len(cells) >= 5
    assert {"image/png", "text/html", "text/plain"} <= kinds[0]
    assert not [output for cell in cells for output in cell.outputs if output.output_type == "error"]
    assert "iframe" not in TOUR.read_text(encoding="utf-8"), "live pages are not stored in the repository"


def test_training_shows_progress_bars_and_a_picture(tour: tuple[Path, Any]) -> None:
    last = [cell for cell in tour[1].cells if cell.cell_type == "code"][-1]
    data = [output.data for output in last.outputs if "data" in output]
    assert len([each for each in data if "application/vnd.jupyter.widget-view+json" in each]) == 3, (
        "two levels, a texture"
    )
    (picture,) = [each["image/png"] for each in data if "image/png" in each]
    assert "> 16x1" in next(each["text/plain"] for each in data if "image/png" in each), "the picture of the last level"
    alpha = np.asarray(Image.open(io.BytesIO(base64.b64decode(picture))))[..., 3]
    assert 0.1 < (alpha > 0).mean() < 0.9
