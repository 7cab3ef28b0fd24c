"""The verb `demo`, which runs other verbs."""

import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mplicits import cli
from mplicits.demo import demo_verb
from mplicits.model.errors import UserError
from mplicits.model.model_file import save
from mplicits.model.options import Options, argument, option
from mplicits.model.verb import Verb
from support.random_model import random_model

FILES = ["render", "bake", "bake"]


@dataclass(frozen=True)
class Command(Options):
    """The options that the demo passes to other verbs."""

    input: str = argument("INPUT", "model or shape")
    output: Path | None = option(None, "file", flags=("-o",))
    target: str | None = option(None, "target")
    levels: str | None = option(None, "levels")
    seconds: str | None = option(None, "seconds")
    shade: str | None = option(None, "shade")


class Verbs:
    """Stand-ins for the verbs that the demo runs; `train` writes a real model file."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        """Names of the verbs that have run, in order."""
        self.inputs: set[str] = set()
        """Models and shapes of the calls."""
        self.failing = ""
        """Name of the verb that raises UserError."""
        self.seconds: str | None = None
        """--seconds of `train`."""
        self.interrupted = False
        """Whether the model that `train` writes comes from an interrupted training."""

    def make(self, name: str) -> Verb:
        def work(command: Command) -> None:
            self.calls.append(name)
            self.inputs.add(command.input)
            if name == self.failing:
                raise UserError("refused")
            if name == "train":
                assert command.output is not None
                self.seconds = command.seconds
                save(replace(random_model((4, 0)), provenance={"interrupted": self.interrupted}), command.output)

        return Verb(name, "", Command, "", work)

    def all(self) -> dict[str, Verb]:
        return {"demo": demo_verb(cli.perform)} | {
            name: self.make(name) for name in ("train", "bake", "render", "view")
        }


@pytest.fixture
def demo(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> tuple[Verbs, list[str]]:
    """The stand-ins, and a command line of the demo without a display."""
    verbs = Verbs()
    monkeypatch.setattr("mplicits.cli.verbs", verbs.all)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    return verbs, ["demo", "--out-dir", str(tmp_path / "a b" / "out")]


def test_the_demo_renders_and_bakes_spot(demo: tuple[Verbs, list[str]], capsys: pytest.CaptureFixture[str]) -> None:
    verbs, argv = demo
    assert cli.main(argv) == 0
    assert (verbs.calls, verbs.inputs) == (FILES, {"spot"})
    out = capsys.readouterr().out
    assert all(f"a b/out/demo.{suffix}" in out for suffix in ("png", "glsl", "html"))


def test_the_demo_trains_if_necessary(demo: tuple[Verbs, list[str]]) -> None:
    verbs, argv = demo
    verbs.interrupted = True
    assert cli.main([*argv, "--train"]) == 0
    verbs.interrupted = False
    for more, trains in ((["--train"], True), (["--train"], False), (["--train", "--seconds", "9"], True)):
        verbs.calls.clear()
        assert cli.main([*argv, *more]) == 0
        assert verbs.calls == ["train"] * trains + FILES
    assert verbs.seconds == "9"
    assert verbs.inputs == {"demo", f"{argv[-1]}/demo.safetensors"}


@pytest.mark.parametrize("variable", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_the_demo_opens_a_window_where_there_is_a_display(
    variable: str, demo: tuple[Verbs, list[str]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    verbs, argv = demo
    monkeypatch.setenv(variable, ":0")
    assert cli.main(argv) == 0
    assert (verbs.calls, verbs.inputs) == (["view"], {"spot"})
    assert not Path(argv[-1]).exists(), "a window writes no files"
    verbs.calls.clear()
    assert cli.main([*argv, "--no-window"]) == cli.main([*argv, "--train"]) == 0
    assert verbs.calls == [*FILES, "train", "view"]
    verbs.calls.clear()
    verbs.failing = "view"
    assert cli.main(argv) == 0
    assert verbs.calls == ["view", *FILES]
    assert "no window: refused" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["train", "bake", "render"])
def test_the_demo_stops_where_a_verb_fails(verb: str, demo: tuple[Verbs, list[str]]) -> None:
    verbs, argv = demo
    verbs.failing = verb
    assert cli.main([*argv, "--train"]) == 2
    assert verbs.calls[-1] == verb


def test_wrong_seconds_make_no_folder(demo: tuple[Verbs, list[str]]) -> None:
    _, argv = demo
    for seconds in ("nan", "0", "-1", "1e9", "many"):
        assert cli.main([*argv, "--train", f"--seconds={seconds}"]) == 2
    assert not Path(argv[-1]).exists()


def hues(path: Path) -> int:
    """Count the hues of a picture, of sixteen. The background and a plain shape have three."""
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
    subprocess.run([*command, "--train", "--seconds", "30"], cwd=tmp_path, check=True)
    assert {path.name for path in out.iterdir()} == {"demo.safetensors", "demo.glsl", "demo.html", "demo.png"}
    assert hues(out / "demo.png") > 4, "a slow machine learns pale colors, but all of them"
    trained = (out / "demo.safetensors").stat().st_mtime_ns
    subprocess.run([*command, "--train"], cwd=tmp_path, check=True)
    assert (out / "demo.safetensors").stat().st_mtime_ns == trained
