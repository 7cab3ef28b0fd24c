"""Examples in the docs run, links and paths exist, and the README's table matches its page."""

import doctest
import re
from pathlib import Path

import pytest

from mplicits.codegen.targets.uniforms import SHADING_PICTURES
from mplicits.viewer.draw.context import Context
from support.paths import ROOT

LINK = re.compile(r"\]\(([^)\s#]*)(?:#([^)\s]*))?\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
PATH = re.compile(r"`((?:[\w.]+/)+[\w.]*)`")
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "model").rglob("*.md")])
README = (ROOT / "README.md").read_text("utf-8")
OUTSIDE = ("image/", "images/", "mask/", "masks/", "sparse/", "models/", "out/", "shapes/", "Shaders/", "../")
"""Folders in the docs that belong to users or lie beside the repository."""


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings."""
    headings = HEADING.findall(page.read_text("utf-8"))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_resolve(page: Path) -> None:
    for target, anchor in LINK.findall(page.read_text("utf-8")):
        if re.match(r"[a-z]+:", target):
            continue
        place = page.parent / target if target else page
        assert place.exists(), target
        assert not anchor or anchor in anchors(place), f"{target}#{anchor}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_named_paths_exist(page: Path) -> None:
    paths = [path for path in PATH.findall(page.read_text("utf-8")) if not path.startswith(OUTSIDE)]
    assert not [path for path in paths if not (ROOT / path).exists()]


@pytest.mark.parametrize("page", ["viewer.md", "web.md"])
def test_docs_list_the_shadings_and_their_keys(page: str) -> None:
    text = (ROOT / "docs" / page).read_text("utf-8")
    assert f"| {', '.join(shading.label for shading in SHADING_PICTURES)} |" in text
    assert f" {' '.join(shading.key for shading in SHADING_PICTURES)} |".lower() in text.lower()


def test_docs_list_the_names_of_shadings() -> None:
    row = re.search(r"^\| `shade` \|.*", (ROOT / "docs" / "engines.md").read_text("utf-8"), re.MULTILINE)
    assert row
    assert set(re.findall(r"`(\w+)`", row[0])) == {"shade", *(shading.name for shading in SHADING_PICTURES)}


def test_index_lists_every_page() -> None:
    index = ROOT / "docs" / "README.md"
    linked = {(index.parent / target).resolve() for target, _ in LINK.findall(index.read_text("utf-8"))}
    pages = {page for page in (ROOT / "docs").rglob("*.md") if page != index}
    assert not sorted(page.name for page in pages - linked)


def test_python_page_examples_give_the_stated_results(
    osmesa: Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    failed, tried = doctest.testfile(str(ROOT / "docs" / "python.md"), module_relative=False, optionflags=flags)
    assert osmesa.software
    assert (failed, tried > 15) == (0, True)
    assert {path.name for path in tmp_path.iterdir()} == {"spot.ply", "spot.frag", "copy.safetensors"}


def test_readme_is_short_and_its_example_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(example.replace('"spot"', '"spot-small"'), "README.md", "exec"), {})
    assert 0 < float(capsys.readouterr().out.splitlines()[0]) < 1
    assert {path.name for path in tmp_path.iterdir()} == {"cow.html", "cow.glb"}
    assert len(example.split("\n\n")[-1].splitlines()) == 4
    assert len(README.splitlines()) <= 100
    assert len(re.findall(r"(?<!!)\[[^\]]*\]\(", README)) <= 10


def rows(text: str, columns: int) -> list[list[str]]:
    """Return the rows of a text's tables with this number of columns."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:1] == "|"]
    return [row for row in cells if len(row) == columns]


def test_readme_table_matches_its_page() -> None:
    page = {row[0]: row for row in rows((ROOT / "docs" / "results" / "surfaces.md").read_text("utf-8"), 8)}
    section = README[README.index("## How near it comes") : README.index("## What it does not do")]
    told = [row for row in rows(section, 7) if row[0].startswith("`")]
    assert [row[0] for row in told] == ["`spot-small`", "`spot`", "`spot-large`"]
    for name, parameters, seconds, *figures in told:
        _, counted, trained, *measured, _ = page[name.strip("`")]
        assert (parameters, seconds) == (counted, f"{trained} s")
        assert [float(figure.removesuffix(" degrees")) for figure in figures] == [float(cell) for cell in measured]


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "results").glob("*.md")), ids=lambda page: page.stem)
def test_result_page_names_its_script_and_version(page: Path) -> None:
    text = page.read_text("utf-8")
    assert re.search(r"mplicits \d+\.\d+\.\d+, .*\d{4}-\d\d-\d\d", text.replace("\n", " "))
    scripts = re.findall(r"(git log -- )?benchmarks/(\w+\.py)", text)
    assert scripts
    assert not [name for past, name in scripts if (ROOT / "benchmarks" / name).exists() == bool(past)]
