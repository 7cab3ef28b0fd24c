"""`mplicits photos`: models of a ball, interruptions, and errors."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

import mplicits
from mplicits import cli
from mplicits.capture.learner import Learner
from mplicits.model.model_file import load
from support.ball_photographs import RADIUS, write_sphere_layout, write_transforms_layout
from support.ball_training import with_texture_steps

TINY = ["--levels", "12x1,16x1", "--omega", "8,12", "--radiance", "16", "--rays", "64", "--held-out", "3", "--quiet"]
SIZE = 24


@pytest.fixture
def few_texture_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mplicits.trainer.config.DEFAULT", with_texture_steps(60))
    monkeypatch.setattr("mplicits.trainer.field_levels.POINTS", 10_000)


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Reconstruct nine photographs of the colored ball."""
    folder = tmp_path_factory.mktemp("photos")
    write_sphere_layout(folder / "ball", 9, SIZE)
    output = folder / "ball.safetensors"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mplicits.trainer.config.DEFAULT", with_texture_steps(600))
        patch.setattr("mplicits.trainer.field_levels.POINTS", 10_000)
        threads = torch.get_num_threads()
        torch.set_num_threads(1)  # beside a busy program, two threads that wait for one another take minutes
        try:
            assert cli.main(["photos", str(folder / "ball"), "-o", str(output), *TINY, "--steps", "900"]) == 0
        finally:
            torch.set_num_threads(threads)
    return output


@pytest.mark.usefixtures("few_texture_steps")
def test_photos_writes_a_model_and_prints_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_sphere_layout(tmp_path / "ball", 9, 24)
    output = tmp_path / "ball.safetensors"
    argv = ["photos", str(tmp_path / "ball"), "-o", str(output), *TINY, "--steps", "40", "--credit", "me, CC0"]
    assert cli.main(argv) == 0
    said = capsys.readouterr()
    assert "9 photographs of 24 x 24 pixels, with masks; 40 steps" in said.out
    assert "3 held out: " in said.out
    assert "001.png, held out: " in said.err
    assert not list(tmp_path.glob("*.part.*"))
    model = load(output)
    assert (model.name, model.credit, model.center) == ("ball", "me, CC0", (5, 6, 7))
    assert model.scale == pytest.approx(2)
    assert len(model.levels) == 2


@pytest.mark.slow
def test_photographs_of_a_ball_reconstruct_the_ball(ball: Path) -> None:
    """The reconstruction starts as a smaller sphere."""
    field = mplicits.load(ball)
    assert field.model.provenance["psnr"] > 17
    directions = np.random.default_rng(0).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radii = np.linspace(0.2, 0.95, 76)
    inside = np.array([field(r * directions) < 0 for r in radii])
    found = inside.sum(axis=0) * (radii[1] - radii[0]) + radii[0]
    assert abs(np.median(found) - RADIUS) < 0.06
    assert np.quantile(abs(found - RADIUS), 0.9) < 0.11
    colors = field.color(found[:, None] * directions)
    assert abs(colors - (0.5 + 0.4 * directions)).mean() < 0.1


@pytest.mark.slow
@pytest.mark.usefixtures("few_texture_steps")
def test_ctrl_c_saves_a_model_that_resume_continues(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_sphere_layout(tmp_path / "ball", 4, 16)
    output, part = tmp_path / "m.safetensors", tmp_path / "m.part.safetensors"
    argv = ["photos", str(tmp_path / "ball"), "-o", str(output), *TINY, "--steps", "60"]
    step, count = Learner.step, 0

    def interrupted(self: Learner, share: float) -> float:
        nonlocal count
        count += 1
        if count > 40:
            raise KeyboardInterrupt
        return step(self, share)

    monkeypatch.setattr(Learner, "step", interrupted)
    assert cli.main(argv) == 0
    assert "stopped by Ctrl-C; the model so far is saved" in capsys.readouterr().err
    assert load(output).provenance["interrupted"]
    assert load(part).provenance["steps"] == 40
    monkeypatch.setattr(Learner, "step", step)
    assert cli.main([*argv, "--resume", "--rays", "65"]) == 2
    assert "the interrupted run had other options" in capsys.readouterr().err
    assert cli.main([*argv, "--resume"]) == 0
    done = load(output).provenance
    assert (done["steps"], done["interrupted"]) == (60, False)
    assert not part.exists()
    assert cli.main([*argv, "--resume"]) == 2
    assert "does not exist" in capsys.readouterr().err


def without_a_camera(folder: Path) -> None:
    """Remove the third camera."""
    path = folder / "transforms.json"
    content = json.loads(path.read_text())
    del content["frames"][2]["transform_matrix"]
    path.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (without_a_camera, "frame 2: no camera; transform_matrix is missing"),
        (lambda folder: (folder / "transforms.json").unlink(), "no cameras; "),
        (shutil.rmtree, "no such folder"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    spoil: Callable[[Path], None], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_transforms_layout(tmp_path / "ball", 4, SIZE)
    spoil(tmp_path / "ball")
    output = tmp_path / "m.safetensors"
    assert cli.main(["photos", str(tmp_path / "ball"), "-o", str(output), *TINY]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1
    assert not output.exists()
