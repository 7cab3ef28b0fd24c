"""What docs/python.md shows is what happens."""

import doctest
from pathlib import Path

import pytest

from mplicits.viewer.draw.context import Context
from support.paths import ROOT


def test_the_python_page_s_examples_give_what_it_says(
    osmesa: Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    failed, tried = doctest.testfile(str(ROOT / "docs" / "python.md"), module_relative=False, optionflags=flags)
    assert osmesa.software
    assert (failed, tried > 15) == (0, True)
    assert {path.name for path in tmp_path.iterdir()} == {"spot.ply", "spot.frag", "copy.safetensors"}
