"""The table of formats is what readers, the page and the docs have."""

import re

import pytest

from mplicits.model.endings import FORMATS, IN_PAGE, MESHES, SHAPES
from mplicits.readers.read import READERS
from mplicits.web.bundle import sources
from support.paths import ROOT


def test_every_format_has_a_reader() -> None:
    assert set(READERS) == set(SHAPES)
    assert set(MESHES) == {ending for ending, content in SHAPES.items() if "mesh" in content}


def test_the_page_reads_what_the_table_says() -> None:
    (parsers,) = re.findall(r"^const PARSERS = \{(.*)\};$", sources()["mesh_file.js"], re.MULTILINE)
    assert {f".{name}" for name in re.findall(r"(\w+):", parsers)} == set(IN_PAGE)


@pytest.mark.parametrize("ending", SHAPES)
def test_the_docs_name_every_ending(ending: str) -> None:
    assert re.search(rf"[` ]{re.escape(ending)}[` ]", (ROOT / "docs" / "inputs.md").read_text("utf-8"))


def test_no_ending_is_of_two_formats() -> None:
    assert len(SHAPES) == sum(len(each.endings) for each in FORMATS)
