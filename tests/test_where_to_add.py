"""ARCHITECTURE.md, "Where to add": what is made up here and added in the listed places only is found everywhere."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mplicits.model.model_file import save
from support.paths import ROOT
from support.random_model import random_model

pytestmark = pytest.mark.slow

LEFT_OUT = shutil.ignore_patterns(".*", "out", "docs", "tests", "benchmarks", "examples", "__pycache__", "gallery")
READER = '''"""Reads a made-up format: numbers, three a point."""

from pathlib import Path

import numpy as np

from .content import Cloud


def read_made_up(path: Path) -> Cloud:
    """Read a sphere's points."""
    points = np.loadtxt(path)
    return Cloud(points, points / np.linalg.norm(points, axis=1, keepdims=True), None)
'''
TARGET = '''"""Target made_up: the number of weights."""


def standalone(model, storage="auto", digits=None):
    return f"{model.parameters()}\\n"
'''


class Copy:
    """A copy of the package."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(ROOT, folder / "mplicits", ignore=LEFT_OUT)

    def write(self, path: str, text: str) -> None:
        """Add a file."""
        (self.folder / "mplicits" / path).write_text(text)

    def insert(self, path: str, before: str, line: str) -> None:
        """Add a line before another."""
        place = self.folder / "mplicits" / path
        text = place.read_text("utf-8")
        assert text.count(before) == 1
        place.write_text(text.replace(before, line + before), "utf-8")

    def run(self, *argv: str) -> str:
        """Run a command line, and return what it prints."""
        run = subprocess.run(
            [sys.executable, "-m", "mplicits", *argv],
            cwd=self.folder,
            env=os.environ | {"PYTHONPATH": str(self.folder)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stderr
        return run.stdout


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    return Copy(tmp_path)


def test_a_reader(copy: Copy) -> None:
    copy.write("readers/made_up.py", READER)
    copy.insert("readers/read.py", "from .npz import", "from .made_up import read_made_up\n")
    copy.insert("readers/read.py", '    ".e57": _points', '    ".made": lambda path, *_: read_made_up(path),\n')
    copy.insert("model/endings.py", '    Format("E57"', '    Format("MADE", (".made",), cloud=True),\n')
    points = np.random.default_rng(0).normal(size=(500, 3))
    np.savetxt(copy.folder / "a.made", points / np.linalg.norm(points, axis=1, keepdims=True))
    assert "a.made: 500 points" in copy.run("check", "a.made")
    assert "NPZ PCD LAS MADE E57" in " ".join(copy.run("train", "--help").split())


def test_a_target(copy: Copy) -> None:
    copy.write("codegen/targets/made_up.py", TARGET)
    line = '    "made_up": Target("codegen.targets.made_up", suffix=".made"),\n'
    copy.insert("bake/registry.py", '    "c": Target(', line)
    model = random_model((4, 0))
    save(model, copy.folder / "m.safetensors")
    copy.run("bake", "m.safetensors", "--target", "made_up")
    assert (copy.folder / "m.made").read_text() == f"{model.parameters()}\n"
    assert "made_up" in copy.run("bake", "--help")


def test_a_weight_of_the_loss_is_not_ignored_by_the_page(copy: Copy) -> None:
    copy.insert("trainer/config.py", "    excess: float = 1.0\n", "    made_up: float = 0.0\n")
    assert "made_up" in copy.run("train", "--help-all")
    with pytest.raises(AssertionError, match="the page has no loss weight made_up"):
        copy.run("studio", "-o", "studio.html")
