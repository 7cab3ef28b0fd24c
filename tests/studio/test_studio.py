"""The verb `studio`, and pages of models that train."""

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mplicits import cli
from mplicits.model import model_file
from support.browser import visit
from support.fitted_model import fitted_model
from support.studio_visit import ball
from support.unpacked import unpacked

if TYPE_CHECKING:
    from playwright.sync_api import Browser


def test_the_verb_writes_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "studio.html"
    assert cli.main(["studio", "-o", str(path)]) == 0
    assert "drop a mesh" in capsys.readouterr().err
    assert '"levels": "48x1,64x4"' in unpacked(path.read_text("utf-8"))


@pytest.mark.slow
def test_the_page_of_a_model_trains_where_asked(
    browser: "Browser", tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    model_file.save(fitted_model((8, 8)), Path("m.safetensors"))
    assert cli.main(["bake", "m.safetensors", "--target", "html", "--shade", "phong", "--studio"]) == 0
    with visit(browser, tmp_path / "m.html", share=0.1) as visited:
        visited.until("document.documentElement.dataset.error")
        assert visited.page.title() == "fitted"
        visited.drop(ball(), "a ball.stl")
        visited.until("document.title === 'a ball'")
        assert visited.console == []
    assert cli.main(["bake", "m.safetensors", "--studio"]) == 2
    assert capsys.readouterr().err.endswith("--studio: only these targets take it: html\n")
