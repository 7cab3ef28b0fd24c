"""The studio in Chromium: a dropped mesh trains, and its model opens in Python."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mplicits import cli
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model import model_file
from mplicits.model.model_file import load
from mplicits.model.quantize import is_quantized
from support.browser import PATIENCE, Visit, visit
from support.fitted_model import fitted_model
from support.studio_visit import CENTER, RADIUS, ball, ready, save, write_page
from support.unpacked import unpacked

if TYPE_CHECKING:
    from playwright.sync_api import Browser


def saved(visited: Visit, path: Path) -> Path:
    """Save the trained model."""
    assert save(visited, "#download", path) == "a-ball.safetensors"
    return path


def test_a_dropped_mesh_trains_to_a_model(browser: "Browser", tmp_path: Path) -> None:
    with visit(browser, write_page(tmp_path / "studio.html", 200), size=(390, 844), share=0.1) as visited:
        ready(visited)
        assert "Drop a mesh" in visited.page.inner_text("#welcome")
        visited.drop(ball(), "a ball.stl")
        visited.page.wait_for_selector("#download")
        model = load(saved(visited, tmp_path / "m.safetensors"))
        visited.still()
        assert visited.root("error") is not None
        assert float(visited.root("error") or 1) < 1e-5
        assert visited.console == []
    assert (model.name, model.provenance["made_by"]) == ("a ball", "page")
    assert all(map(is_quantized, model.networks().values()))
    np.testing.assert_allclose(model.center, CENTER, atol=1e-6)
    assert model.scale == pytest.approx(RADIUS)
    points = np.random.default_rng(0).normal(size=(2000, 3)).astype(np.float32)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    f = np.abs(interpret.field(lower(model), points, 2)).mean()
    assert model.provenance["levels"][1]["mean_f"] == pytest.approx(f, rel=0.5)
    assert f < 0.02
    assert cli.main(["info", str(tmp_path / "m.safetensors")]) == 0


def paused(visited: Visit) -> str:
    """Wait until the report stays the same for a second. Returns it."""
    end = time.monotonic() + PATIENCE / 1000
    while time.monotonic() < end:
        report = visited.page.inner_text("#report")
        visited.page.wait_for_timeout(1000)
        if visited.page.inner_text("#report") == report:
            return report
    pytest.fail("the training does not pause")


def test_pause_stop_and_bad_files(browser: "Browser", tmp_path: Path) -> None:
    with visit(browser, write_page(tmp_path / "studio.html", 100_000), size=(390, 844), share=0.1) as visited:
        ready(visited)
        for data, name, message in (
            (b"v 1 2", "bad.obj", "bad.obj: line 1: a vertex needs three numbers"),
            (
                b"1 2 3",
                "cloud.xyz",
                "cloud.xyz: a point cloud without normals; train it with: mplicits train cloud.xyz",
            ),
            (b"v 1 1 1\nf 1 1 1", "point.obj", "point.obj: all vertices are at one place, or too far apart"),
        ):
            visited.drop(data, name)
            visited.until(f"document.querySelector('#message p').textContent === {message!r}")
            assert visited.page.is_visible("#choose")
        visited.drop(ball(), "a ball.stl")
        visited.until("document.getElementById('shapes').textContent.startsWith('14x1')")
        visited.page.click("#pause")
        before = paused(visited)
        visited.page.click("text=Go on")
        visited.until(f"document.getElementById('report').textContent !== {before!r}")
        visited.page.click("#stop")
        visited.page.wait_for_selector("#download")
        assert len(load(saved(visited, tmp_path / "m.safetensors")).levels) == 1
        assert visited.console == []


def test_the_verb_writes_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "studio.html"
    assert cli.main(["studio", "-o", str(path)]) == 0
    assert "drop a mesh" in capsys.readouterr().err
    assert '"levels": "48x1,64x4"' in unpacked(path.read_text("utf-8"))


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
