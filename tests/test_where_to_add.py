"""ARCHITECTURE.md, "Where to add": what is made up here and added in the listed places only is found everywhere."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits.model.model_file import save
from support.browser import visit
from support.fitted_model import fitted_model
from support.paths import ROOT
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

LEFT_OUT = shutil.ignore_patterns(".*", "out", "docs", "tests", "benchmarks", "examples", "__pycache__", "gallery")
READER = '''"""Reads a made-up format: numbers, three a point."""

from pathlib import Path
from typing import TYPE_CHECKING

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


def pixels(path: Path) -> NDArray[np.uint8]:
    """Return the sRGB of a picture, (height, width, 3)."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def mirrored(first: NDArray[np.uint8], second: NDArray[np.uint8]) -> bool:
    """Whether the middles of two pictures, which have no background, are alike with red and blue exchanged."""
    height, width, _ = first.shape
    middle = slice(3 * height // 8, 5 * height // 8), slice(3 * width // 8, 5 * width // 8)
    a, b = (picture[middle].astype(np.int16) for picture in (first, second))
    return bool(np.abs(a - b[..., ::-1]).max() <= 2 < np.abs(a - b).max())


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


def test_a_shading(copy: Copy, browser: "Browser") -> None:
    end = ')\n"""The index is the value of the uniform `shading`."""'
    copy.insert("codegen/targets/uniforms.py", end, '    Shading("made_up", "Made up", "E"),\n')
    copy.insert("glsl/functions/shadings.glsl", "const int SHADE_DATA", "const int SHADE_MADE_UP = 7;\n")
    line = "    if (shading == SHADE_MADE_UP) return 0.5 + 0.5 * normal.zyx;\n"
    copy.insert("glsl/functions/shade.glsl", "    if (shading == SHADE_TEXTURE)", line)
    save(fitted_model(), copy.folder / "m.safetensors")
    for shade in ("normal", "made_up"):
        copy.run("render", "m.safetensors", "--shade", shade, "--size=64", "--context=osmesa", "-o", f"{shade}.png")
    assert mirrored(*(pixels(copy.folder / f"{shade}.png") for shade in ("normal", "made_up")))
    for verb in ("render", "view"):
        assert "texture,softbox,made_up" in "".join(copy.run(verb, "--help").split())
    copy.run("bake", "m.safetensors", "--target", "html")
    with visit(browser, copy.folder / "m.html") as visited:
        assert visited.page.locator("#shading label").all_inner_texts()[-1] == "Made up"
        visited.page.keyboard.press("n")
        normal = visited.saved()
        visited.page.keyboard.press("e")
        assert visited.page.input_value("#shading input:checked") == "made_up"
        assert mirrored(normal, visited.saved())


def test_a_weight_of_the_loss_is_not_ignored_by_the_page(copy: Copy) -> None:
    copy.insert("trainer/config.py", "    excess: float = 1.0\n", "    made_up: float = 0.0\n")
    assert "made_up" in copy.run("train", "--help-all")
    with pytest.raises(AssertionError, match="the page has no loss weight made_up"):
        copy.run("studio", "-o", "studio.html")
