"""A window whose turntable turns for some seconds leaks neither memory nor OpenGL objects."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import ROOT

ROW = re.compile(
    r"\| the turntable of a window \| 12 s \| memory grows by (?P<slope>[-\d,]+) bytes each second, within "
    r"(?P<within>[\d.]+) MiB in all; (?P<objects>\d+) objects of OpenGL all the time; (?P<pictures>[\d,]+) pictures \|"
)


@pytest.mark.slow
@pytest.mark.usefixtures("xvfb")
def test_a_turntable_leaves_nothing_behind(tmp_path: Path) -> None:
    script, page = ROOT / "benchmarks" / "reliability.py", tmp_path / "page.md"
    subprocess.run([sys.executable, str(script), "--turntable", "12", "-o", str(page)], check=True, cwd=tmp_path)
    row = ROW.search(page.read_text())
    assert row, page.read_text()
    assert float(row["within"]) < 2
    assert int(row["objects"]) > 10
    assert int(row["pictures"].replace(",", "")) > 20
