"""A model in a notebook: its picture, and its page in a frame that runs only while it is visible."""

import base64
import html
import io
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

import mplicits
from mplicits.api import notebook, pictures
from support.browser import PATIENCE, listen
from support.fitted_model import fitted_model
from support.page_pictures import use_small_posters
from support.random_model import random_model
from support.scene_models import composed

if TYPE_CHECKING:
    from playwright.sync_api import Browser

BALL = mplicits.Field(fitted_model((8, 16)))
HOSTILE = '"></iframe><script>alert(1)</script>'
TAGS = r'<div [^<>]*><img [^<>]*><iframe [^<>]*srcdoc="[^"<>]*"></iframe></div>'
"""The HTML of a model: no other tag, and no attribute that ends early."""
COUNT = 20
"""Models on one page: more than a browser's WebGL contexts."""
SIDE = 64
"""Pixels along each side of the pictures in these tests."""


@pytest.fixture(scope="module", autouse=True)
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "SIDE", SIDE)
        use_small_posters(patch)
        yield


@pytest.fixture(scope="module")
def bundle() -> dict[str, str]:
    return BALL._repr_mimebundle_()


def document(frame: str) -> str:
    """Return the document in the attribute of an iframe."""
    (found,) = re.findall(r'srcdoc="([^"]*)"', frame)
    return html.unescape(found)


def test_the_picture_shows_the_model(bundle: dict[str, str]) -> None:
    assert bundle["text/plain"] == repr(BALL)
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(bundle["image/png"]))))
    assert image.shape == (SIDE, SIDE, 4)
    assert 0.1 < (image[..., 3] > 0).mean() < 0.95


def test_joined_lines_of_the_script_stay_valid(bundle: dict[str, str]) -> None:
    frame = bundle["text/html"]
    assert re.fullmatch(TAGS, frame)
    (script,) = re.findall(r"</script><script>(.*)</script>", document(frame), re.DOTALL)
    assert "//" not in script
    assert not re.search(r'(src|href)="(?!data:)', document(frame))
    for line in script.strip().splitlines():
        assert line.rstrip()[-1] in ";{}(,", f"{line}: its end is that of a statement or a block"


def test_hostile_names_stay_inside() -> None:
    frame = notebook.frame(mplicits.Field(random_model((4, 0), name=HOSTILE)), "")
    assert re.fullmatch(TAGS, frame)
    assert "<script>alert" not in document(frame)


def test_a_scene_is_live_too(tmp_path: Path) -> None:
    scene = composed(tmp_path, '[[parts]]\nmodel = "ball.safetensors"\n', widths=(4, 8))
    bundle = mplicits.Field(scene)._repr_mimebundle_()
    assert re.fullmatch(TAGS, bundle["text/html"])
    assert bundle["image/png"] in bundle["text/html"]
    page = json.loads(re.findall(r'<script type="application/json">(.*?)</script>', document(bundle["text/html"]))[0])
    assert "<canvas" in page


def test_show_opens_a_page_in_the_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []

    def browse(url: str) -> bool:
        opened.append(url)
        return True

    monkeypatch.setattr("webbrowser.open", browse)
    field = mplicits.Field(random_model((4, 0), name="a/b c"))
    field.show()
    assert opened[0].endswith("/a-b-c.html")
    assert 'id="packed"' in Path(opened[0].removeprefix("file://")).read_text(encoding="utf-8")
    monkeypatch.setattr("webbrowser.open", lambda _: False)
    with pytest.raises(mplicits.UserError, match=r"open .*\.html in one"):
        field.show()


def test_show_displays_a_model_in_a_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    displayed: list[object] = []
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=None)))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=displayed.append))
    field = mplicits.Field(random_model((4, 0)))
    field.show()
    assert displayed == [field]


@pytest.mark.slow
def test_twenty_models_share_a_page(browser: "Browser", tmp_path: Path) -> None:
    """Only visible models run, and each runs again when it is scrolled back into view."""
    frame = notebook.frame(mplicits.Field(random_model((4, 0))), "")
    cells = "".join(f'<div style="width:480px;height:440px">{frame}</div>' for _ in range(COUNT))
    (tmp_path / "notebook.html").write_text(f"<!doctype html><body>{cells}", encoding="utf-8")
    context = browser.new_context(offline=True, device_scale_factor=0.1, viewport={"width": 600, "height": 480})
    context.set_default_timeout(PATIENCE)
    page, messages = context.new_page(), list[str]()
    listen(page, messages)
    page.goto((tmp_path / "notebook.html").as_uri())

    def running() -> list[int]:
        """Return the cells whose page runs."""
        outer = page.query_selector_all("iframe")
        frames = [element.content_frame() for element in outer]
        return [i for i, entry in enumerate(frames) if entry is not None and entry.child_frames]

    for cell in (0, 7, COUNT - 1, 0):
        page.evaluate("y => scrollTo(0, y)", 440 * cell)
        for _ in range(600):
            page.wait_for_timeout(100)
            if running() == [cell]:
                break
        assert running() == [cell]
        frame_of_cell = page.query_selector_all("iframe")[cell].content_frame()
        assert frame_of_cell is not None
        frame_of_cell.child_frames[0].wait_for_function("() => 'drawn' in document.documentElement.dataset")
    context.close()
    assert messages == []


def test_a_picture_may_spell_the_names_of_other_parts() -> None:
    """0.4 % of all pictures have "PAGE" in their base64."""
    png = "PAGELIGHTPICTUREDARK" + "A" * 20
    within = document(notebook.frame(BALL, png))
    assert within.count(f"data:image/png;base64,{png}") == 1
    (text,) = re.findall(r'<script type="application/json">(.*?)</script>', within, re.DOTALL)
    assert json.loads(text).startswith("<!doctype html>")
