"""A killed training resumes from its checkpoint, and ends with the weights of an uninterrupted one."""

import dataclasses
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
import pytest
import torch
import trimesh

from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.model.interrupts import ENDINGS, SecondInterrupt, begin_work, ended_by
from mplicits.model.model import Model
from mplicits.model.model_file import load, save
from mplicits.trainer import machine
from mplicits.trainer.checkpoint import CheckpointFile
from mplicits.trainer.networks.muon import Muon
from mplicits.trainer.networks.snapshot import Snapshot
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training
from support.ball_training import SMALL_SETTINGS, Log, use_quick_config
from support.random_model import random_model

SETTINGS = dataclasses.replace(SMALL_SETTINGS, steps=(60, 60, 60))
PACKED = dataclasses.replace(SETTINGS, packed=True)
OUTPUT, PART = Path("ball.safetensors"), Path("ball.part.safetensors")
QUICK = ["--levels", "8x0,8x1", "--quiet"]


class KilledError(BaseException):
    """Stands for the end of the process."""


class Killing(Log):
    """A progress that kills the training in the middle of a stage."""

    def __init__(self, stage: str) -> None:
        super().__init__(stage, 0.5)

    def advance(self, fraction: float, loss: float) -> None:
        try:
            super().advance(fraction, loss)
        except KeyboardInterrupt:
            raise KilledError from None


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        use_quick_config(patch)
        yield


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    machine.prepare(torch.device("cpu"))
    mesh = trimesh.creation.icosphere(subdivisions=4)
    mesh.visual.vertex_colors = np.uint8(127 + 127 * mesh.vertices)
    path = tmp_path_factory.mktemp("ball") / "ball.ply"
    mesh.export(path)
    return load_shape(str(path))[0]


@pytest.fixture(scope="module")
def unbroken(ball: Shape) -> Callable[[bool], Model]:
    """A function that returns the model of an uninterrupted training, packed or not."""
    return cache(lambda packed: Training(ball, PACKED if packed else SETTINGS, Log()).run())


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    assert cli.main(["train", "ball.ply", "-o", str(OUTPUT), *QUICK, "--steps", "20", *argv]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize(
    ("stage", "packed"),
    [
        pytest.param("level 1", False, marks=pytest.mark.slow),
        ("level 2", False),
        pytest.param("level 2", True, marks=pytest.mark.slow),
        ("tex", False),
    ],
)
def test_a_resumed_training_has_the_weights_of_an_uninterrupted_one(
    ball: Shape, unbroken: Callable[[bool], Model], stage: str, packed: bool
) -> None:
    settings, log = PACKED if packed else SETTINGS, Log()
    with pytest.raises(KilledError):
        Training(ball, settings, Killing(stage), part=CheckpointFile(OUTPUT, log.say, 0.0)).run()
    before, snapshot = CheckpointFile(OUTPUT, log.say, 0.0).read()
    record = before.provenance["texture"] or before.provenance["levels"][-1]
    assert record["fraction"] == pytest.approx(0.5, abs=0.15)
    resumed = Training(ball, settings, log, part=CheckpointFile(OUTPUT, log.say, 0.0)).run(before, snapshot)
    assert log.stages[0].startswith(stage)
    assert log.lines == []
    for name, tensor in unbroken(packed).tensors().items():
        np.testing.assert_array_equal(resumed.tensors()[name], tensor, err_msg=name)
    assert resumed.sha256() == unbroken(packed).sha256()


def test_other_settings_resume_from_the_weights_only(ball: Shape) -> None:
    log = Log()
    with pytest.raises(KilledError):
        Training(ball, SETTINGS, Killing("level 2"), part=CheckpointFile(OUTPUT, log.say, 0.0)).run()
    longer = dataclasses.replace(SETTINGS, steps=(60, 120, 60))
    model = Training(ball, longer, log).run(*CheckpointFile(OUTPUT, log.say, 0.0).read())
    assert "only its weights are used" in log.lines[0]
    assert len(model.levels) == 2


def test_the_seconds_of_all_runs_count_together(ball: Shape) -> None:
    timed = dataclasses.replace(SETTINGS, seconds=30.0)
    log = Log("level 1", 0.01)
    Training(ball, timed, log, part=CheckpointFile(OUTPUT, log.say, 0.0)).run()
    model, snapshot = CheckpointFile(OUTPUT, log.say, 0.0).read()
    late = dataclasses.replace(model, provenance=model.provenance | {"seconds": 29.5})
    with pytest.raises(UserError, match=r"--seconds 30: .* took 30 s"):
        Training(ball, timed, Log()).run(late, snapshot)


def press(monkeypatch: pytest.MonkeyPatch, ending: Callable[[], None]) -> None:
    """Let the command line's trainings call `ending` in the middle of level 2."""
    stages: list[str] = []

    def advance(bar: TrainingBar, fraction: float, loss: float) -> None:
        if fraction > 0.5 and stages[-1].startswith("level 2"):
            ending()

    monkeypatch.setattr(TrainingBar, "begin", lambda bar, stage: stages.append(stage))
    monkeypatch.setattr(TrainingBar, "advance", advance)


def test_a_checkpoint_is_a_model_and_is_removed_at_the_end(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def kill() -> None:
        raise KilledError

    trimesh.creation.icosphere(2).export("ball.ply")
    with monkeypatch.context() as patch:
        press(patch, kill)
        with pytest.raises(KilledError):
            cli.main(["train", "ball.ply", *QUICK, "--steps", "20"])
    assert not OUTPUT.exists()
    assert len(load(PART).levels) == 1
    assert cli.main(["info", str(PART)]) == 0
    assert "interrupted" in capsys.readouterr().out
    assert cli.main(["train", "ball.ply", *QUICK, "--steps", "20"]) == 0
    assert "ball.part.safetensors is of an interrupted training" in capsys.readouterr().err
    assert not PART.exists()


@pytest.mark.usefixtures("usual_signals")
@pytest.mark.parametrize("number", ENDINGS)
def test_a_signal_saves_the_model_and_a_checkpoint(
    number: signal.Signals, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    trimesh.creation.icosphere(2).export("ball.ply")
    argv = ["train", "ball.ply", *QUICK, "--steps", "20,60"]
    with monkeypatch.context() as patch:
        press(patch, lambda: signal.raise_signal(number))
        assert cli.main(argv) == 128 + number
    said = f"stopped by {number.name}; the training so far is saved; --resume continues it\n"
    assert capsys.readouterr().err == said
    assert 0.5 < load(OUTPUT).provenance["levels"][1]["fraction"] < 0.9
    assert cli.main([*argv, "--resume"]) == 0
    assert all("more steps" in line for line in capsys.readouterr().err.splitlines()), "of so few steps"
    record = load(OUTPUT).provenance["levels"][1]
    assert (record["fraction"], record["steps"]) == (1, 60)
    assert not PART.exists()


def test_other_files_are_no_checkpoint(capsys: pytest.CaptureFixture[str]) -> None:
    trimesh.creation.icosphere(3).export("ball.ply")
    model = random_model((8, 0))
    save(model, PART)
    assert "move it away" in refused(capsys)
    PART.write_bytes(b"somebody's")
    assert "move it away" in refused(capsys)
    assert PART.read_bytes() == b"somebody's"
    save(model, PART, ("[", {}))
    assert "damaged" in refused(capsys, "--resume")


@pytest.mark.parametrize("wrong", ["steps", "draws.random", "draws.surface.drawn", "network"])
def test_a_damaged_checkpoint_is_refused_in_one_line(wrong: str, ball: Shape) -> None:
    with pytest.raises(KilledError):
        Training(ball, SETTINGS, Killing("level 1"), part=CheckpointFile(OUTPUT, print, 0.0)).run()
    before, snapshot = CheckpointFile(OUTPUT, print, 0.0).read()
    assert wrong in snapshot.numbers
    snapshot.numbers[wrong] = {"steps": -1, "network": [16, 1]}.get(wrong, "x")
    if wrong == "network":
        snapshot.tensors["weight.0"] = torch.zeros(2, 2)
    with pytest.raises(UserError, match="training"):
        Training(ball, SETTINGS, Log()).run(before, snapshot)


def test_a_training_continues_on_a_full_disk(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise UserError("cannot write ball.part.safetensors: No space left on device")

    monkeypatch.setattr("mplicits.trainer.checkpoint.save", full)
    log = Log()
    model = Training(ball, SETTINGS, log, part=CheckpointFile(OUTPUT, log.say, 0.0)).run()
    assert len(model.levels) == 2
    (line,) = log.lines
    assert "No space left" in line


def test_nothing_is_written_beside_a_device(ball: Shape) -> None:
    beside = CheckpointFile(Path("/dev/null"), print)
    beside.write(random_model((4, 0)), Snapshot())
    assert not beside.path.exists()
    assert not beside.due()


@pytest.mark.usefixtures("usual_signals")
@pytest.mark.parametrize(
    ("number", "stage"),
    [
        *((signal.SIGINT, stage) for stage in ("level 1", "level 2", "tex")),
        *(pytest.param(end, "level 2", marks=pytest.mark.slow) for end in ENDINGS),
    ],
)
def test_a_signal_inside_a_step_waits_for_its_end(
    number: signal.Signals, stage: str, ball: Shape, unbroken: Callable[[bool], Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The signal comes between gradient and optimizer; the resumed training has every bit of an unbroken one."""
    log, steps = Log(), [0]
    take = Muon.step

    def pressed(optimizer: Muon, factor: float) -> None:
        steps[0] += log.stages[-1].startswith(stage)
        if steps[0] == 20:
            signal.raise_signal(number)
        take(optimizer, factor)

    begin_work()
    with monkeypatch.context() as patch:
        patch.setattr(Muon, "step", pressed)
        stopped = Training(ball, SETTINGS, log, part=CheckpointFile(OUTPUT, log.say)).run()
    record = stopped.provenance["texture"] or stopped.provenance["levels"][-1]
    assert record["steps"] == 20
    resumed = Training(ball, SETTINGS, log, part=CheckpointFile(OUTPUT, log.say)).run(
        *CheckpointFile(OUTPUT, log.say).read()
    )
    assert resumed.sha256() == unbroken(False).sha256()


@pytest.mark.usefixtures("usual_signals")
def test_a_second_signal_ends_the_training_inside_the_step(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(_: Muon, __: float) -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)

    begin_work()
    monkeypatch.setattr(Muon, "step", pressed)
    with pytest.raises(SecondInterrupt):
        Training(ball, SETTINGS, Log(), part=CheckpointFile(OUTPUT, print)).run()
    assert not PART.exists()
    assert ended_by() == signal.SIGTERM


@pytest.mark.slow
@pytest.mark.usefixtures("usual_signals")
@pytest.mark.parametrize("number", ENDINGS)
def test_a_signal_at_any_moment_can_be_resumed_bit_for_bit(number: signal.Signals) -> None:
    """A training in its own process gets the signal again and again at random moments, until it is through."""
    trimesh.creation.icosphere(3).export("ball.ply")
    argv = ["train", "ball.ply", *QUICK, "--steps", "500"]

    def run(output: str, *more: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "mplicits", *argv, "-o", output, *more]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    with run("unbroken.safetensors") as process:
        began = time.perf_counter()
        assert process.wait() == 0
        whole = time.perf_counter() - began
    moments, stopped = Random(int(number)), 0
    for _ in range(30):
        with run(str(OUTPUT), "--resume") as process:
            try:
                process.wait(moments.uniform(0.2, 1.0) * whole)
            except subprocess.TimeoutExpired:
                process.send_signal(number)
            code = process.wait()
        stopped += code == 128 + number
        assert code in (0, 128 + number, -number), "the last one: Python was still starting"
        if code == 0 and stopped:
            break
        if code == 0:  # the unbroken training took longer than this one: another program was busy
            OUTPUT.unlink()
            whole /= 2
    else:
        with run(str(OUTPUT), "--resume") as process:
            assert process.wait() == 0
    assert stopped
    assert load(OUTPUT).sha256() == load(Path("unbroken.safetensors")).sha256()


def test_the_log_is_not_the_file_of_the_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The end of the training would remove it."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(["train", "demo", "-o", "m.safetensors", "--log", "m.part.safetensors", "--steps", "1"]) == 2
    assert "--log m.part.safetensors: that is the file of the training's state" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
