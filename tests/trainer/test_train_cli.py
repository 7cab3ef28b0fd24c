"""`mplicits train` through the command line: its options, outputs and exit codes."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import mplicits
from mplicits import cli
from mplicits.api import pictures
from mplicits.model.errors import UserError
from mplicits.model.model import Model, size_text
from mplicits.model.model_file import load, save
from mplicits.model.packed_weights import pack
from mplicits.model.surface_figures import surface_record
from mplicits.trainer import settings
from mplicits.trainer.config import DefaultLengths
from mplicits.trainer.progress import TrainingBar, TrainingLog
from support.ball_training import QUICK as QUICK_CONFIG
from support.ball_training import Log, use_quick_config

QUICK = ("--levels", "8x0,8x1", "--steps", "20", "--quiet")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    use_quick_config(monkeypatch)


@pytest.fixture
def ball(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    trimesh.creation.icosphere(subdivisions=3).export("ball.ply")
    return "ball.ply"


def refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """Run `mplicits train`, which must refuse its arguments in one line. Returns that line."""
    assert cli.main(["train", *argv]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


def test_the_default_output_is_the_shapes_name(ball: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["train", ball, *QUICK]) == 0
    model = load(Path("ball.safetensors"))
    assert [size_text(level.network) for level in model.levels] == ["8x0", "8x1"]
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 7
    record = surface_record(model.provenance)
    assert record is not None
    assert printed[0] == f"surface: off by {record.shape.told()}"
    assert printed[1].startswith("level 1: 8x0, mean |f| ")
    assert f"{model.provenance['levels'][1]['angle']:.2f} degrees" in printed[2]
    assert printed[3].startswith("distance: off by ")
    assert printed[4].startswith("|grad f| on the surface: ")
    assert printed[5].startswith("ball.safetensors: ")
    assert printed[6].startswith("surface: ")


def test_omega_weights_and_seed_are_in_the_provenance(ball: str) -> None:
    options = ("--omega", "5,7", "--weights", "normal=7", "--seed", "3", "--texture", "none")
    assert cli.main(["train", ball, "-o", "m.safetensors", *QUICK, *options, "--resume"]) == 0, "nothing to resume yet"
    provenance = load(Path("m.safetensors")).provenance
    assert provenance["seed"] == 3
    assert provenance["settings"]["omegas"] == [5.0, 7.0]
    assert provenance["settings"]["weights"] == {"normal": 7.0}


@pytest.mark.slow
def test_a_finished_model_is_rounded_before_it_is_saved(
    ball: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    saved: list[Model] = []

    def counted(model: Model, path: Path) -> None:
        saved.append(model)
        save(model, path)

    monkeypatch.setattr("mplicits.trainer.session.save", counted)
    assert cli.main(["train", ball, "-o", "m.safetensors", *QUICK, "--bits", "8"]) == 0
    assert len(saved) == 1
    assert pack(load(Path("m.safetensors")).networks()) is not None
    assert "bytes, packed" in capsys.readouterr().err
    assert pack(mplicits.train(ball, levels="8x0,8x1", steps=20, quiet=True, bits=8).model.networks()) is not None


def test_resuming_adds_a_level(ball: str) -> None:
    assert cli.main(["train", ball, "--levels", "8x0", "--steps", "20", "--quiet"]) == 0
    before = load(Path("ball.safetensors"))
    assert cli.main(["train", ball, *QUICK, "--resume"]) == 0
    after = load(Path("ball.safetensors"))
    assert len(after.levels) == 2
    assert (after.levels[0].network[0].weight == before.levels[0].network[0].weight).all()


def test_the_bar_shows_level_loss_and_time_left(ball: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["train", ball, "--levels", "8x0", "--steps", "200"]) == 0
    shown = capsys.readouterr().err
    assert "level 1 (8x0)" in shown
    assert re.search(r"mean \|f\| \d\.\d\de-\d\d", shown)
    assert " left" in shown


def test_log_and_preview_show_the_progress(
    ball: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pictures, "SIDE", 24)
    argv = ["train", ball, "--quiet", "--log", "log.jsonl", "--preview", "seen"]
    assert cli.main([*argv, "--levels", "8x0", "--steps", "40"]) == 0
    assert cli.main([*argv, "--levels", "8x0,8x1", "--steps", "30", "--resume"]) == 0
    lines = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    steps = [*((1, step) for step in (10, 20, 30, 40)), *((2, step) for step in (10, 20, 30))]
    assert [(line["level"], line["step"]) for line in lines] == steps
    assert [line["network"] for line in lines] == ["8x0"] * 4 + ["8x1"] * 3
    named = {"value", "normal", "distance", "eikonal", "mean_f", "fraction", "loss", "seconds"}
    assert all(line.keys() >= named for line in lines)
    measured = load(Path("ball.safetensors")).provenance["levels"][-1]["mean_f"]
    assert lines[-1]["mean_f"] == pytest.approx(measured, rel=0.2), "at fewer points"
    assert sorted(path.name for path in Path("seen").iterdir()) == ["ball-1.png", "ball-2.png"]
    with Image.open("seen/ball-2.png") as picture:
        assert picture.size == (24, 24)
        assert 0.1 < (np.asarray(picture)[..., 3] > 0).mean() < 0.9
    Path("notes.txt").write_text("mine")
    capsys.readouterr()
    assert f"--preview {ball}: File exists" in refused(capsys, ball, "--preview", ball)
    assert "not a log" in refused(capsys, ball, "--log", "notes.txt")
    assert "the model file" in refused(capsys, ball, "--log", "ball.safetensors")
    assert Path("notes.txt").read_text() == "mine"


def test_a_texture_s_lines_say_so_and_a_full_disk_ends_the_log_alone(tmp_path: Path) -> None:
    told = Log()
    log = TrainingLog(told, tmp_path / "log.jsonl")
    log.begin("texture (8x0)")
    log.tell(10, {"colour": 0.5, "along": math.nan})
    log.advance(0.25, 0.75)
    (line,) = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert line.pop("seconds") >= 0
    assert line == {
        **{"level": None, "network": "8x0", "step": 10, "fraction": 0.25, "loss": 0.75},
        **{"colour": 0.5, "along": None},
    }
    full = TrainingLog(told, Path("/dev/full"))
    full.begin("level 1 (8x0)")
    full.advance(0.5, 1.0)
    full.advance(0.6, 1.0)
    assert told.lines == ["warning: the log ends here: No space left on device"]


@pytest.mark.parametrize("way", ["command", "function"])
def test_the_surface_of_the_last_level_is_searched_for_loose_components(
    ball: str, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    config, searched = replace(QUICK_CONFIG, mining=replace(QUICK_CONFIG.mining, components_steps=5)), []

    def search(model: Model) -> np.ndarray:
        searched.append(len(model.levels))
        return np.array([[0.0, 1.1, 0.0]], np.float32)

    monkeypatch.setattr("mplicits.trainer.config.DEFAULT", config)
    monkeypatch.setattr("mplicits.mesher.surface_line.loose_components", search)
    if way == "command":
        assert cli.main(["train", ball, "--levels", "8x1,8x1", "--steps", "20,40", "--quiet"]) == 0
    else:
        mplicits.train(ball, "8x1,8x1", steps="20,40", quiet=True)
    assert searched == [2, 2]


def test_ctrl_c_saves_the_model_and_says_so(
    ball: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def press(self: TrainingBar, fraction: float, loss: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(TrainingBar, "advance", press)
    assert cli.main(["train", ball, *QUICK]) == 0
    assert "saved" in capsys.readouterr().err
    assert load(Path("ball.safetensors")).provenance["interrupted"]


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (("--levels", "64"), "--levels"),
        (("--levels", "64x1,,64x2"), "--levels"),
        (("--levels", "0x1"), "--levels"),
        (("--levels", "99999x1"), "--levels"),
        (("--levels", "8x0," * 9 + "8x0"), "at most 8"),
        (("--omega", "30"), "--omega"),
        (("--omega", "30,x,3"), "--omega"),
        (("--omega", "30,-1,3"), "--omega"),
        (("--steps", "0"), "--steps"),
        (("--steps", "nan"), "--steps"),
        (("--steps", "1,2,3,4,5"), "--steps"),
        (("--seconds", "0"), "--seconds"),
        (("--seconds", "nan"), "--seconds"),
        (("--seconds", "soon"), "--seconds"),
        (("--seconds", "9", "--steps", "9"), "not allowed with"),
        (("--seed", "-1"), "--seed"),
        (("--weights", "normals=3"), "--weights"),
        (("--weights", "normal"), "--weights"),
        (("--weights", "normal=-3"), "--weights"),
        (("--preset", "huge"), "--preset"),
        (("--texture", "picture.png"), "--texture"),
    ],
)
def test_bad_options_are_refused_in_one_line(
    ball: str, capsys: pytest.CaptureFixture[str], argv: tuple[str, ...], says: str
) -> None:
    assert says in refused(capsys, ball, "--preset", "paper", *argv)


@pytest.mark.parametrize("output", ["no/such/folder/m.safetensors", "."])
def test_an_unwritable_output_is_found_before_the_shape_is_read(
    ball: str, capsys: pytest.CaptureFixture[str], output: str
) -> None:
    assert "cannot write" in refused(capsys, "missing.ply", "-o", output)


def test_a_missing_cuda_device_is_refused_in_one_line(
    ball: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    assert "--device" in refused(capsys, ball, "--device", "cuda")


def test_missing_steps_repeat_the_last_and_missing_omegas_are_the_default() -> None:
    assert settings.steps("5", 3) == (5, 5, 5, 5)
    assert settings.steps("5,6", 3) == (5, 6, 6, 6)
    omegas = DefaultLengths.omegas
    wide, narrow = ((64, 1),) * 4, ((16, 1),) * 2
    assert settings.omegas(None, wide) == (*omegas, omegas[-1])
    assert settings.omegas(None, narrow) == (omegas[0] / 2, omegas[1] / 2)
    with pytest.raises(UserError):
        settings.steps("1.5", 2)


def test_a_sparse_cloud_is_trained_and_saved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    normals = np.random.default_rng(0).normal(size=(100, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.savez(tmp_path / "sparse.npz", points=normals, normals=normals)
    path = tmp_path / "m.safetensors"
    argv = ["train", str(tmp_path / "sparse.npz"), "--levels", "8x1,8x1", "--steps", "20,20", "-o", str(path)]
    assert cli.main([*argv, "--quiet"]) == 0
    assert load(path).provenance["field"]["band_error"] > 0
    assert "in the last level's band" in capsys.readouterr().out
