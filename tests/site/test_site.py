"""The verb `gallery`: the files of a site, its links in a browser, and files that it must not overwrite."""

import dataclasses
import re
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote, unquote, urlparse

import pytest
from PIL import Image

from mplicits.cli import main
from mplicits.model.model_file import load, save
from mplicits.model.quantize import quantized_model
from mplicits.web.about import PREVIEW
from support.browser import PATIENCE
from support.page_pictures import use_small_posters
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

HOSTILE = 'a&"><script>alert(1)</script> #1%'


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of a model whose name is HTML, of a moving one, and of a file that is no model; pictures are small."""
    use_small_posters(monkeypatch)
    folder = tmp_path / "models"
    folder.mkdir()
    hostile = quantized_model(random_model((8, 1), (8, 1), texture=(8, 1), name=HOSTILE))
    save(dataclasses.replace(hostile, credit=HOSTILE), folder / f"{HOSTILE.replace('/', '')}.safetensors")
    save(random_model((8, 1), name="moving", inputs="xyzt"), folder / "moving.safetensors")
    (folder / "notes.txt").write_text("no model")
    return folder


def test_links_lead_to_the_files_of_each_model(
    browser: "Browser", models: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "a" / "site"
    (models / "moving.safetensors").rename(models / "moving\x1b[2J.safetensors")
    assert main(["gallery", str(site), "--models", str(models), "--title", HOSTILE]) == 0
    told = capsys.readouterr().err
    assert "moving\\x1b[2J.tiny.html" in told, "nothing reaches the terminal as it is"
    assert "\x1b" not in told
    page = browser.new_page()
    page.set_default_timeout(PATIENCE)
    problems: list[str] = []
    page.on("console", lambda message: problems.append(message.text))
    page.on("dialog", lambda dialog: problems.append(dialog.message))
    page.goto((site / "index.html").as_uri())
    assert page.title() == HOSTILE
    assert page.locator("h2").all_inner_texts() == [HOSTILE.replace("/", ""), "moving\x1b[2J"]
    assert page.locator("img").evaluate_all("(images) => images.every((image) => image.naturalWidth > 0)")
    assert HOSTILE in page.locator("figcaption p").all_inner_texts()
    links = {
        Path(unquote(urlparse(url).path)) for url in page.locator("a").evaluate_all("(all) => all.map((a) => a.href)")
    }
    pictures = {path for path in site.iterdir() if path.suffix == ".jpg"}
    assert links == set(site.iterdir()) - {site / "index.html"} - pictures
    assert (len(links), len(pictures)) == (2 * 4, 2)
    assert not problems
    assert load(site / "moving\x1b[2J.safetensors").inputs == "xyzt"
    page.close()


@pytest.mark.slow
def test_the_models_of_the_package_are_the_default(
    monkeypatch: pytest.MonkeyPatch, models: Path, tmp_path: Path
) -> None:
    monkeypatch.setattr("mplicits.model.gallery.FOLDER", models)
    assert main(["gallery", str(tmp_path / "site")]) == 0
    assert main(["gallery", str(tmp_path / "site")]) == 0  # what it wrote itself it writes anew
    assert (tmp_path / "site" / "moving.html").is_file()


def test_an_address_gives_readers_of_links_pictures(models: Path, tmp_path: Path) -> None:
    """Chats resolve no relative addresses: without --url there are none."""
    (models / "moving.safetensors").unlink()
    tags = re.compile(r'<meta property="og:(\w+)" content="([^"]*)">')
    name = quote(HOSTILE.replace("/", ""))
    for arguments, expected in (
        ([], {}),
        (
            ["--url", "https://example.org/a"],
            {"url": "https://example.org/a/", "image": f"https://example.org/a/{name}.jpg"},
        ),
    ):
        site = tmp_path / f"site{len(arguments)}"
        assert main(["gallery", str(site), "--models", str(models), *arguments]) == 0
        index, page = ((site / file).read_text() for file in ("index.html", f"{unquote(name)}.html"))
        told = dict(tags.findall(index))
        assert (told["title"], told["type"]) == ("Neural shapes", "website")
        assert {key: told[key] for key in ("url", "image") if key in told} == expected
        assert dict(tags.findall(page)).get("url") == (expected["url"] + name + ".html" if expected else None)
        with Image.open(next(site.glob("*.jpg"))) as picture:
            assert (picture.format, picture.size) == ("JPEG", PREVIEW)
    assert main(["gallery", str(tmp_path / "site"), "--models", str(models), "--url", "example.org"]) == 2


@pytest.mark.parametrize("name", ["index.html", "moving.html", "moving.jpg"])
def test_files_of_the_user_stay(name: str, models: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    site = tmp_path / "site"
    site.mkdir()
    (site / name).write_text("<p>mine</p>")
    assert main(["gallery", str(site), "--models", str(models)]) == 2
    assert name in capsys.readouterr().err
    assert [path.name for path in site.iterdir()] == [name]
    assert (site / name).read_text() == "<p>mine</p>"


def test_bad_folders_are_one_line(models: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (models / "torn.safetensors").write_bytes(b"no model")
    for arguments in (
        [str(tmp_path / "site"), "--models", str(tmp_path / "nowhere")],
        [str(tmp_path / "site"), "--models", str(tmp_path)],  # without models
        [str(tmp_path / "site"), "--models", str(models)],
        [str(models / "notes.txt")],
        [str(models), "--models", str(models)],
    ):
        assert main(["gallery", *arguments]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert not (tmp_path / "site").exists()
