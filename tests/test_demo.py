"""The verb `demo`, which is made of the other verbs."""

import dataclasses
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mplicits import cli
from mplicits.demo import demo_verb
from mplicits.model import gallery
from mplicits.model.errors import UserError
from mplicits.model.model_file import save
from mplicits.model.verb import Verb
from support.random_model import random_model

FILES = ["render", "bake", "bake"]


class Verbs:
    """Stand-ins for the verbs that the demo runs; `train` writes a real model file."""

    def __init__(self) -> None:
        self.called: list[str] = []
        """Names of the verbs that have run, in their order."""
        self.inputs: set[str] = set()
        """Models and shapes that the verbs were given."""
        self.refusing = ""
        """Name of the verb that raises UserError."""
        self.seconds: str | None = None
        """What --seconds of `train` was."""
        self.interrupted = False
        """Whether the model that `train` writes says that its training was cut short."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        parser.add_argument("input")
        for option in ("-o", "--target", "--levels", "--seconds", "--shade"):
            parser.add_argument(option)

    def make(self, name: str) -> Verb:
        def run(args: Namespace) -> None:
            self.called.append(name)
            self.inputs.add(args.input)
            if name == self.refusing:
                raise UserError("refused")
            if name == "train":
                self.seconds = args.seconds
                model = dataclasses.replace(random_model((4, 0)), provenance={"interrupted": self.interrupted})
                save(model, Path(args.o))

        return Verb(name, "", self.add_arguments, "", run)

    def all(self) -> dict[str, Verb]:
        return {"demo": demo_verb(cli.perform)} | {
            name: self.make(name) for name in ("train", "bake", "render", "view")
        }


@pytest.fixture
def demo(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> tuple[Verbs, list[str]]:
    """The stand-ins for the other verbs, and a command line of the demo without a display."""
    stand_ins = Verbs()
    monkeypatch.setattr("mplicits.cli.verbs", stand_ins.all)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    return stand_ins, ["demo", "--out-dir", str(tmp_path / "a b" / "out")]


def test_the_demo_writes_spot_s_picture_and_what_is_baked(
    demo: tuple[Verbs, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    verbs, argv = demo
    assert cli.main(argv) == 0
    assert (verbs.called, verbs.inputs) == (FILES, {"spot"})
    assert "spot" in gallery.names()
    out = capsys.readouterr().out
    assert all(f"a b/out/demo.{suffix}" in out for suffix in ("png", "glsl", "html"))


def test_the_demo_trains_once(demo: tuple[Verbs, list[str]]) -> None:
    verbs, argv = demo
    for more, trained in ((["--train"], True), (["--train"], False), (["--retrain"], True), (["--seconds", "9"], True)):
        verbs.called.clear()
        assert cli.main([*argv, *more]) == 0
        assert verbs.called == ["train"] * trained + FILES
    assert verbs.seconds == "9"
    assert verbs.inputs == {"demo", f"{argv[-1]}/demo.safetensors"}


def test_the_demo_trains_anew_where_training_was_cut_short(demo: tuple[Verbs, list[str]]) -> None:
    verbs, argv = demo
    verbs.interrupted = True
    assert cli.main([*argv, "--train"]) == cli.main([*argv, "--train"]) == 0
    assert verbs.called == ["train", *FILES] * 2


@pytest.mark.parametrize("variable", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_the_demo_opens_a_window_where_there_is_a_display(
    variable: str, demo: tuple[Verbs, list[str]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    verbs, argv = demo
    monkeypatch.setenv(variable, ":0")
    assert cli.main(argv) == 0
    assert (verbs.called, verbs.inputs) == (["view"], {"spot"})
    assert not Path(argv[-1]).exists(), "a window writes no files"
    verbs.called.clear()
    assert cli.main([*argv, "--no-window"]) == cli.main([*argv, "--train"]) == 0
    assert verbs.called == [*FILES, "train", "view"]
    verbs.called.clear()
    verbs.refusing = "view"
    assert cli.main(argv) == 0
    assert verbs.called == ["view", *FILES]
    assert "no window: refused" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["train", "bake", "render"])
def test_the_demo_stops_where_a_verb_fails(verb: str, demo: tuple[Verbs, list[str]]) -> None:
    verbs, argv = demo
    verbs.refusing = verb
    assert cli.main([*argv, "--train"]) == 2
    assert verbs.called[-1] == verb


def test_seconds_that_are_no_duration_make_no_folder(demo: tuple[Verbs, list[str]]) -> None:
    _, argv = demo
    for seconds in ("nan", "0", "-1", "1e9", "many"):
        assert cli.main([*argv, "--train", f"--seconds={seconds}"]) == 2
    assert not Path(argv[-1]).exists()


def hues(path: Path) -> int:
    """Count the hues of a picture, of sixteen. The background and a shape without colours have three."""
    hsv = np.asarray(Image.open(path).convert("RGB").convert("HSV"))
    shares = np.bincount(hsv[hsv[..., 1] > 15][:, 0] // 16, minlength=16) / hsv[..., 0].size
    return int(np.count_nonzero(shares > 0.003))


@pytest.mark.slow
@pytest.mark.usefixtures("osmesa")
def test_the_demo_makes_a_picture_and_keeps_its_model(tmp_path: Path) -> None:
    command, out = [sys.executable, "-m", "mplicits", "demo", "--no-window"], tmp_path / "out"
    subprocess.run(command, cwd=tmp_path, check=True)
    assert {path.name for path in out.iterdir()} == {"demo.glsl", "demo.html", "demo.png"}
    assert Image.open(out / "demo.png").info["Title"] == "spot"
    subprocess.run([*command, "--seconds", "60"], cwd=tmp_path, check=True)
    assert {path.name for path in out.iterdir()} == {"demo.safetensors", "demo.glsl", "demo.html", "demo.png"}
    assert hues(out / "demo.png") > 4, "a slow machine learns pale colours in a minute, but all of them"
    trained = (out / "demo.safetensors").stat().st_mtime_ns
    subprocess.run([*command, "--train"], cwd=tmp_path, check=True)
    assert (out / "demo.safetensors").stat().st_mtime_ns == trained
