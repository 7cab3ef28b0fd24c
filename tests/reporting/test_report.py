"""`mplicits report`: a page that loads nothing, escapes all texts, and shows the model and its log."""

import base64
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

import mplicits
from mplicits import cli
from mplicits.bake import facts
from mplicits.bake.registry import TARGETS
from mplicits.model.model_file import save
from mplicits.reporting import pictures
from mplicits.reporting.curves import diagram, read_log
from mplicits.reporting.page import report
from support.browser import PATIENCE
from support.paths import DEMO
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

HOSTILE = '<script>alert(1)</script>"&'


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small pictures, and the sizes of two quick targets; tests/bake measures all of them."""
    monkeypatch.setattr(pictures, "SIDE", 24)
    monkeypatch.setattr(pictures, "SLICE", 48)
    monkeypatch.setattr(facts, "TARGETS", {name: TARGETS[name] for name in ("wgsl", "c")})


@pytest.fixture
def log(tmp_path: Path) -> Path:
    lines = [
        {"level": 1, "network": "8x0", "step": 10 * k, "mean_f": 0.1 / k, "loss": 1 / k, "value": None, "normal": 0.5}
        for k in range(1, 6)
    ]
    lines += [{"level": None, "network": HOSTILE, "step": 10, "colour": 0.25}]
    path = tmp_path / "log.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines) + '{"level": 1, "ne')
    return path


class Tags(HTMLParser):
    """Collects the tags of a page, with their attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))


def picture(url: str | None) -> np.ndarray:
    assert url is not None
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))))


def test_the_page_shows_all_parts_and_loads_nothing(log: Path, tmp_path: Path) -> None:
    truth = tmp_path / "truth.ply"
    mplicits.load(DEMO).mesh(24, quiet=True).save(truth)
    text = mplicits.report(DEMO, truth, log)
    tags = Tags(text).tags
    assert not {"script", "link", "iframe", "object"} & {tag for tag, _ in tags}
    sources = [attributes[key] for _, attributes in tags for key in ("src", "href") if key in attributes]
    assert all(source is not None and source.startswith("data:image/png") for source in sources)
    titles = [attributes["alt"] for tag, attributes in tags if tag == "img"]
    assert titles[:3] == ["level 1 (32x1)", "level 2 (40x2)", "texture (40x2)"]
    assert {"from the front", "from behind", "slice"} <= set(titles)
    assert all(picture(source).size for source in sources)
    assert len([tag for tag, _ in tags if tag == "svg"]) == 2
    for text_part in ("Error on the surface", "wgsl", "multiply-adds", "omegas", "mean |f|, held out"):
        assert text_part in text


def test_names_and_settings_are_escaped(log: Path) -> None:
    model = random_model((4, 0), name=HOSTILE)
    model = replace(model, credit=HOSTILE, provenance={"settings": {HOSTILE: HOSTILE}, "source": {"name": HOSTILE}})
    text = report(model, log=log)
    assert "<script" not in text
    assert text.count("&lt;script&gt;") >= 6


def test_curves_match_the_log(log: Path) -> None:
    first, texture = read_log(log)
    assert [line["step"] for line in first] == [10, 20, 30, 40, 50], "half a line at the end is ignored"
    (points,) = re.findall(r'class="mean_f" points="([^"]*)"', diagram(first))
    x, y = np.array([pair.split(",") for pair in points.split()], float).T
    np.testing.assert_allclose(np.diff(x), np.diff(x)[0], atol=0.15)
    expected = np.log10([0.1 / k for k in range(1, 6)])
    np.testing.assert_allclose((y - y[0]) / (y[-1] - y[0]), (expected - expected[0]) / np.ptp(expected) * -1, atol=0.01)
    assert "value" not in re.findall(r'polyline class="(\w+)"', diagram(first)), "null is not a point"
    assert "color term" in diagram(texture)


def test_colors_match_the_distance() -> None:
    field = mplicits.load(DEMO)
    images, distances = pictures.errors(field.model, lambda points: np.full(len(points), 1e-5))
    assert (distances == 1e-5).all()
    for image in images:
        pixels = image[image[..., 3] > 0].astype(float)
        assert 0.1 < len(pixels) / 24**2 < 0.9
        ratio = pixels[:, :3] / pixels[:, 2:3]
        np.testing.assert_allclose(ratio, np.tile(pictures.RAMP[0] / pictures.RAMP[0, 2], (len(ratio), 1)), atol=0.05)
    np.testing.assert_allclose(pictures.colors_of(np.array([1e-9, 1e-2, 5.0])), pictures.RAMP[[0, -1, -1]])


def test_the_slice_shows_sign_and_bands() -> None:
    field = mplicits.load(DEMO)
    image = pictures.slice_of(field.model).astype(float)
    axis = (np.arange(48) + 0.5) / 24 - 1
    z, y = np.meshgrid(axis, -axis)
    coarse = field(np.stack((np.zeros_like(z), y, z), axis=-1), 1)
    band = np.abs(coarse) < field.model.levels[0].delta
    plain = (image == pictures.OUTSIDE).all(axis=-1)
    assert plain.sum() > 300
    assert (coarse[plain] > 0).all()
    assert not (plain & band).any()


def test_the_verb_writes_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.safetensors"
    save(random_model((4, 0)), path)
    page = tmp_path / "page.html"
    assert cli.main(["report", str(path), "-o", str(page)]) == 0
    assert page.read_text() == mplicits.report(path)
    assert cli.main(["report", str(path), "-o", str(page)]) == 0, "a report may be overwritten"
    (tmp_path / "mine.html").write_text("mine")
    (tmp_path / "bad.jsonl").write_text("[1]\n")
    capsys.readouterr()
    for argv, said in (
        (["-o", str(tmp_path / "mine.html")], "not a report"),
        (["-o", str(page), "--log", str(tmp_path / "bad.jsonl")], "bad.jsonl:1: not a line of"),
        (["-o", str(page), "--log", str(tmp_path / "none")], "No such file"),
        (["-o", str(page), "--shape", str(tmp_path / "none.ply")], "none.ply"),
    ):
        assert cli.main(["report", str(path), *argv]) == 2
        lines = capsys.readouterr().err.strip().splitlines()
        assert len(lines) == 1
        assert said in lines[0]


@pytest.mark.slow
def test_the_page_in_a_browser(browser: "Browser", log: Path, tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text(mplicits.report(DEMO, log=log))
    context = browser.new_context(offline=True, viewport={"width": 390, "height": 800})
    context.set_default_timeout(PATIENCE)
    page, said = context.new_page(), list[str]()
    page.on("console", lambda message: said.append(message.text))
    page.goto((tmp_path / "page.html").as_uri())
    assert page.evaluate("() => [...document.images].every(image => image.naturalWidth > 0)")
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth"), (
        "the page is not wider than a phone"
    )
    context.close()
    assert said == []
