"""The page that the studio writes of a model: the same as Python's page, without the studio."""

import base64
import dataclasses
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from mplicits.model.model import Model
from mplicits.model.model_file import to_bytes
from mplicits.web.bundle import sources
from mplicits.web.document import Studio, packed
from mplicits.web.page import POSTER_SIDE, empty_page, page_of, poster_pixels
from mplicits.web.studio_page import parts
from support.browser import Visit, visit
from support.page_pictures import MODEL, differ
from support.random_model import random_model
from support.unpacked import unpacked

if TYPE_CHECKING:
    from playwright.sync_api import Browser

HOSTILE = '</script><script>document.title = "bad"</script><!-- " & \x01poster\x01'
EXPORT = """([bytes, posts]) => globalThis.exported(new Uint8Array(bytes), posts)"""
HOOK = """
globalThis.exported = async (bytes, posts) => (
    pageText(bytes, lowestPoint(parseModel(bytes.slice().buffer)), "phong",
        posts ? await posterOf(renderer, "phong") : undefined));
"""


@pytest.fixture(scope="module")
def studio(browser: "Browser", tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The studio's page, whose functions for an export a test can call."""
    path, more, found = tmp_path_factory.mktemp("export") / "studio.html", parts(), sources() | {"hook.js": HOOK}
    more = dataclasses.replace(more, modules=(*more.modules, "hook.js"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mplicits.web.bundle.sources", lambda: found)
        path.write_text(packed(empty_page("studio", "phong", more)).text, encoding="utf-8")
    return path


def exported(visited: Visit, model: Model, poster: bool = False) -> str:
    visited.until("'exported' in globalThis")
    text = visited.page.evaluate(EXPORT, [list(to_bytes(model)), poster])
    assert isinstance(text, str)
    return text


class Pieces(HTMLParser):
    """The tags and texts of a page, but those of the model."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[object] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, sorted((key, value or "") for key, value in attributes)))

    def handle_data(self, data: str) -> None:
        if lines := "\n".join(line for line in data.splitlines() if line.strip()):
            self.found.append(lines)


def facts_of(page: str) -> dict[str, object]:
    found = re.search(r'id="facts">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    facts = json.loads(found[1])
    assert isinstance(facts, dict)
    return facts


def test_the_exported_page_is_python_s(browser: "Browser", studio: Path) -> None:
    model = dataclasses.replace(MODEL, name="a ball", credit="me", front=(40.0, -10.0))
    with visit(browser, studio) as visited:
        ours = exported(visited, model)
        assert visited.console == []
    theirs = packed(page_of(model, poster=False, shade="phong", studio=Studio())[0]).text
    pages = [unpacked(page) for page in (ours, theirs)]
    mine, expected = (facts_of(page) for page in pages)
    assert mine["ground"] == pytest.approx(expected["ground"], abs=2e-3)
    assert sorted(mine) == sorted(expected)
    for key in set(mine) - {"ground", "sha256", "points", "values"}:
        assert mine[key] == (list(model.front or ()) if key == "front" else expected[key]), key
    outside = [re.sub(r'(id="packed">)[^<]*', r"\1", page) for page in (ours, theirs)]
    inside = [
        re.sub(r'(id="(facts|weights|prologue)">).*?(</script>)', r"\1\3", page, flags=re.DOTALL) for page in pages
    ]
    for ours, theirs in (outside, inside):
        assert Pieces(ours).found == Pieces(theirs).found


@pytest.mark.slow
def test_the_exported_page_draws_the_model(browser: "Browser", studio: Path, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    with visit(browser, studio, share=0.2) as visited:
        visited.until("'ready' in document.documentElement.dataset")
        visited.page.evaluate("document.getElementById('training').hidden = true")  # the viewer has no bar
        visited.drop(to_bytes(MODEL), "ball.safetensors")
        visited.still()
        before = visited.saved()
        text = exported(visited, MODEL, poster=True)
        assert len(text) < 0.8 * len(studio.read_bytes())
        file.write_text(text, encoding="utf-8")
        visited.still()
        assert visited.console == []
    url = re.search(r'<img id="poster"[^>]* src="data:image/webp;base64,([^"]*)"', text)
    assert url is not None
    poster = np.asarray(Image.open(io.BytesIO(base64.b64decode(url[1]))).convert("RGBA")).astype(float)
    expected = poster_pixels(MODEL, POSTER_SIDE).astype(float)
    assert np.abs(poster - expected)[..., 3].mean() < 2
    inside = expected[..., 3] == 255
    assert np.abs(poster - expected)[inside].mean() < 4
    with visit(browser, file, share=0.2) as visited:
        visited.still()
        assert float(visited.root("error") or "nan") < 5e-6
        assert visited.page.title() == "fitted"
        assert visited.page.locator("#training, #worker, #kernel").count() == 0
        assert not differ(visited.saved(), before)
        visited.drop(b"v 0 0 0", "spot.obj")
        visited.page.wait_for_selector("#message:not([hidden])")
        assert "mplicits train spot.obj" in visited.message()
        assert visited.console == []


def test_hostile_names_do_nothing(browser: "Browser", studio: Path, tmp_path: Path) -> None:
    file, model = tmp_path / "page.html", random_model((4, 0), name=HOSTILE)
    with visit(browser, studio) as visited:
        text = exported(visited, dataclasses.replace(model, credit=HOSTILE))
        file.write_text(text, encoding="utf-8")
        assert visited.console == []
    with visit(browser, file) as visited:
        visited.until("document.documentElement.dataset.storage")
        assert visited.page.text_content("h1") == HOSTILE
        assert visited.page.title() == HOSTILE.replace("\x01", "")
        assert visited.page.locator("script").count() == unpacked(text).count("<script")
        assert visited.console == []
