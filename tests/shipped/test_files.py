"""The other files that ship: the gallery's index, texts and models, and the committed copies in docs/gallery."""

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from mplicits.model import gallery
from mplicits.site.write import INDEX
from mplicits.viewer.draw.context import Context
from support.conditions import CONDITIONS, conditioned
from support.likeness import check_alike
from support.paths import ROOT
from support.references import PIXELS, SHARE, SIZE, STILL, check_rendered, rendered
from support.shadertoy import picture
from support.shadertoy_player import player_picture
from support.stranger import Stranger
from support.tabs import chromium_tab, steady
from support.unpacked import unpacked

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

COMMITTED = ROOT / "docs" / "gallery"
POSTER = re.compile(r'(<img id="poster"[^>]* src=")[^"]*')
"""The poster of a page, whose bytes differ between processors."""


@pytest.mark.parametrize("path", sorted(COMMITTED.glob("*.html")), ids=lambda path: path.stem)
def test_committed_pages_are_those_of_this_commit(path: "Path", shipped: Stranger) -> None:
    """`python benchmarks/gallery.py --pages` writes them."""
    made = shipped.folder / "studio.html" if path.stem == "studio" else shipped.folder / "site" / path.name
    ours, theirs = (POSTER.sub(r"\1", unpacked(page.read_text("utf-8"))) for page in (path, made))
    assert ours == theirs, f"{path.name} is older than the code: python benchmarks/gallery.py --pages"


@pytest.mark.parametrize("name", gallery.names())
def test_committed_pictures_show_the_models(name: str, shipped: Stranger) -> None:
    """The first square of each is the model in the studio's light, at its first moment."""
    strip = np.asarray(Image.open(COMMITTED / f"{name}.png").convert("RGB"), np.int16)
    side = strip.shape[0]
    drawn = rendered(shipped, name, size=(side, side), more="--samples 4 --background '#ffffff'")
    check_alike(strip[:, :side], f"committed-{name}", drawn)


@pytest.mark.parametrize("name", ["slow", "phone"])
def test_the_index(name: str, browser: "Browser", shipped: Stranger) -> None:
    """All its pictures are seen, its links lead to all files of the site, and nothing is wider than the window."""
    folder = shipped.folder / "site"
    with conditioned(browser, folder / INDEX, CONDITIONS[name], SIZE, SHARE) as tab:
        tab.evaluate("document.images.length && [...document.images].forEach((image) => { image.loading = 'eager'; })")
        tab.until("[...document.images].every((image) => image.complete && image.naturalWidth)")
        files = tab.evaluate("[...document.querySelectorAll('a, img')].map((each) => each.href ?? each.src)")
        assert {file.rpartition("/")[2] for file in files} == {path.name for path in folder.iterdir()} - {INDEX}
        assert len(gallery.names()) == tab.evaluate("document.images.length")


@pytest.mark.parametrize("name", gallery.names())
def test_the_shadertoy_text_in_another_player(name: str, osmesa: Context, shipped: Stranger, tmp_path: "Path") -> None:
    path = shipped.folder / "site" / f"{name}.frag"
    if not path.exists() and path.name not in (shipped.folder / "site" / INDEX).read_text("utf-8"):
        pytest.skip("the model has no such text")
    text = path.read_text("utf-8").replace("#define AA 1", "#define AA 2")
    check_alike(player_picture(text, PIXELS, tmp_path), f"{name}-player", picture(osmesa, text, size=PIXELS))


@pytest.mark.parametrize("name", gallery.names())
def test_the_model_file(name: str, shipped: Stranger) -> None:
    shown = shipped.run(f"mplicits info {name}.safetensors", shipped.folder / "site")
    assert shown == shipped.run(f"mplicits info {name}")


def test_a_packed_model(browser: "Browser", shipped: Stranger) -> None:
    """Dropped on the page of another model, it shows what `mplicits render` draws of it."""
    shipped.run("mplicits pack spot-small -o packed.safetensors --force")
    path = shipped.folder / "packed.safetensors"
    with chromium_tab(browser, shipped.folder / "site" / "bob-small.html", SIZE, SHARE) as tab:
        tab.until(STILL)
        tab.visit.drop(path.read_bytes(), path.name)
        tab.until(f"document.title.includes('spot') && {STILL}")
        check_rendered(steady(tab), shipped, str(path), "", "packed")
        assert tab.console() == []
