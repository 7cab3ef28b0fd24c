"""Mesh, page and shader of a model of photographs; `mplicits photos` after a signal and bad input."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from mplicits import cli
from mplicits.model.model_file import load
from support.ball_photographs import RADIUS, write_sphere_layout, write_transforms_layout
from support.ball_training import with_texture_steps

TINY = ["--levels", "12x1,16x1", "--omega", "8,12", "--radiance", "16", "--rays", "64", "--held-out", "3", "--quiet"]
SIZE = 24


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Reconstruct nine photographs of the colored ball."""
    folder = tmp_path_factory.mktemp("photos")
    write_sphere_layout(folder / "ball", 9, SIZE)
    output = folder / "ball.safetensors"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mplicits.trainer.config.DEFAULT", with_texture_steps(200))
        patch.setattr("mplicits.trainer.measured.POINTS", 10_000)
        threads = torch.get_num_threads()
        torch.set_num_threads(1)  # two that wait for one another take minutes beside a busy program
        try:
            assert cli.main(["photos", str(folder / "ball"), "-o", str(output), *TINY, "--steps", "300"]) == 0
        finally:
            torch.set_num_threads(threads)
    return output


@pytest.mark.slow
def test_the_mesh_of_the_model_has_the_photographs_colors(ball: Path, tmp_path: Path) -> None:
    """The ball has color 0.5 + 0.4 n, scale 2 and center (5, 6, 7) in the cameras' space."""
    written = tmp_path / "ball.ply"
    assert cli.main(["mesh", str(ball), "-o", str(written), "--resolution", "48", "--quiet"]) == 0
    mesh: Any = trimesh.load_mesh(written)
    normals = (np.asarray(mesh.vertices) - (5, 6, 7)) / 2
    radius = np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.median(radius) == pytest.approx(RADIUS, abs=0.12)
    colors = np.asarray(mesh.visual.vertex_colors)[:, :3] / 255
    for channel in range(3):
        assert np.corrcoef(colors[:, channel], (normals / radius)[:, channel])[0, 1] > 0.7


@pytest.mark.slow
@pytest.mark.parametrize(("target", "ending"), [("html", "html"), ("shadertoy", "glsl")])
def test_page_and_shader_contain_the_weights(ball: Path, tmp_path: Path, target: str, ending: str) -> None:
    written = tmp_path / f"ball.{ending}"
    assert cli.main(["bake", str(ball), "--target", target, "-o", str(written)]) == 0
    text = written.read_text(encoding="utf-8")
    assert load(ball).sha256() in text if target == "html" else "mainImage" in text
    assert "texture" in text


@pytest.mark.slow
def test_sigterm_saves_a_model_that_resume_continues(tmp_path: Path) -> None:
    """The exit code is 128 + SIGTERM's 15."""
    write_sphere_layout(tmp_path / "ball", 9, SIZE)
    output, part = tmp_path / "m.safetensors", tmp_path / "m.part.safetensors"
    command = f"{sys.executable} -m mplicits photos {tmp_path / 'ball'} -o {output} --steps 600"
    argv = [*command.split(), *TINY]
    environment = os.environ | {"OMP_NUM_THREADS": "2"}
    working = subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert working.stderr is not None
    for line in working.stderr:
        if "held out: " in line:  # a tenth of the steps is over
            break
    working.send_signal(signal.SIGTERM)
    _, said = working.communicate(timeout=120)
    assert working.returncode == 128 + signal.SIGTERM
    assert "stopped by SIGTERM; the model so far is saved; --resume continues it" in said
    stopped = load(output).provenance
    assert stopped["interrupted"]
    assert stopped["steps"] < 600
    assert part.exists()
    done = subprocess.run([*argv, "--resume"], check=False, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    after = load(output).provenance
    assert not after["interrupted"]
    assert after["steps"] == 600
    assert not part.exists()


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
