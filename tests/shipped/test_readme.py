"""The README's commands, word for word, in a clean copy of the checkout."""

import re
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from support.display import virtual_display
from support.paths import ROOT
from support.stranger import Stranger, ended

pytestmark = pytest.mark.slow

README = (ROOT / "README.md").read_text("utf-8")
INSTALL = re.compile(r"# (pip install .*)")
"""What a block of Python needs."""
FILE = re.compile(r'"(\w+\.\w+)"')
"""A file that a line of Python writes."""
WAIT = 300
"""Longest wait for a window, seconds."""


def blocks(language: str) -> list[str]:
    """Return the README's blocks of a language."""
    found = re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found
    return found


@pytest.fixture(scope="module")
def bin(shipped: Stranger) -> str:
    """The folder of an environment's programs, and the system's: PATH for the README's commands."""
    shipped.run("python -m venv readme")
    return f"{shipped.folder}/readme/bin:/usr/local/bin:/usr/bin:/bin"


def test_python(bin: str, shipped: Stranger) -> None:
    for text in blocks("python"):
        shipped.run(INSTALL.findall(text)[0], shipped.source, PATH=bin)
        (shipped.folder / "example.py").write_text(text, encoding="utf-8")
        shipped.run("mkdir -p python")
        printed = shipped.run("python ../example.py", shipped.folder / "python", PATH=bin)
        assert 0 < float(printed) < 1, "the example prints a distance and nothing else"
        assert {path.name for path in (shipped.folder / "python").iterdir()} == set(FILE.findall(text))


def test_shell(bin: str, shipped: Stranger, tmp_path: Path) -> None:
    """The lines run one after the other. `shape.obj` is a mesh of Spot."""
    for line in "".join(blocks("sh")).splitlines():
        if line.startswith("mplicits train"):
            shipped.run("mplicits mesh spot -o shape.obj --resolution 100", shipped.source, PATH=bin)
        if line.startswith("mplicits view"):
            view(shipped, line, bin, tmp_path)
        else:
            shipped.run(line, shipped.source, PATH=bin)
    facts = shipped.run("mplicits info shape.safetensors", shipped.source, PATH=bin)
    off = re.search(r"off by (\d\.\d+e-\d+)", facts)
    assert off, facts
    assert float(off[1]) < 1e-3


def view(shipped: Stranger, line: str, path: str, folder: Path) -> None:
    """Run a line that opens a window, and close it when it shows a picture."""
    with virtual_display(folder=folder) as environment:
        process = shipped.start(line, shipped.source, PATH=path, DISPLAY=environment["DISPLAY"])
        end = time.monotonic() + WAIT
        while colors_on_screen(folder) < 50:
            assert process.poll() is None, ended(process)
            assert time.monotonic() < end, "the window shows no picture"
            time.sleep(0.5)
        process.terminate()
        process.wait(WAIT)


def colors_on_screen(folder: Path) -> int:
    """Count the colors on a display. folder: of `virtual_display`, where X writes a dump that ends with the pixels."""
    pixels = (folder / "Xvfb_screen0").read_bytes()[-640 * 480 * 4 :]
    return len(np.unique(np.frombuffer(pixels, np.uint32)))


def test_demo(shipped: Stranger) -> None:
    """Without a display the first command of the README writes pictures."""
    assert "`./run demo`" in README
    shipped.run("./run demo", shipped.source)
    (picture, *_) = sorted((shipped.source / "out").rglob("*.png"))
    assert len(np.unique(np.asarray(Image.open(picture).convert("L")))) > 50
