"""`mplicits mesh` writes files that others read, and prints what is in them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.model.model_file import load, save
from support.paths import DEMO


def mesh(*argv: str) -> int:
    """Run `mplicits mesh` on the demo model, coarsely, with more arguments; return the exit code."""
    return cli.main(["mesh", str(DEMO), "--resolution", "48", "--quiet", *argv])


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb", ".PLY"])
def test_trimesh_reads_what_the_verb_writes(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"out{suffix}"
    assert mesh("-o", str(path), "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    read = trimesh.load(path, force="mesh")
    assert isinstance(read, trimesh.Trimesh)
    assert read.is_watertight
    assert read.volume > 0
    assert (len(read.vertices), len(read.faces)) == (facts["vertices"], facts["faces"])
    assert facts["components"] == len(read.split(only_watertight=False))
    assert (facts["spurious"], facts["culled"]) == (0, True)
    if suffix != ".stl":
        assert isinstance(read.visual, trimesh.visual.ColorVisuals)
        colors = np.asarray(read.visual.vertex_colors)[:, :3]
        assert np.ptp(colors.astype(int), axis=0).max() > 50


def test_the_mesh_is_in_the_space_that_is_asked_for(tmp_path: Path) -> None:
    moved = replace(load(DEMO), center=(10.0, -20.0, 5.0), scale=3.0)
    save(moved, tmp_path / "m.safetensors")
    bounds = {}
    for space in ("input", "model"):
        path = tmp_path / f"{space}.ply"
        argv = ["mesh", str(tmp_path / "m.safetensors"), "-o", str(path), "--resolution", "32", "--quiet"]
        assert cli.main([*argv, "--space", space]) == 0
        bounds[space] = np.asarray(trimesh.load(path, force="mesh").bounds)
    np.testing.assert_allclose(bounds["input"], bounds["model"] * 3.0 + (10, -20, 5), atol=1e-5)


def test_a_level_changes_the_mesh_and_dense_evaluation_does_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counts = []
    for argv in (["--level", "1"], [], ["--no-cull"]):
        assert mesh("-o", str(tmp_path / "m.ply"), *argv) == 0
        read = trimesh.load(tmp_path / "m.ply", force="mesh", process=False)
        assert isinstance(read, trimesh.Trimesh)
        counts.append(len(read.vertices))
    assert counts[0] != counts[1] == counts[2]
    assert f"{counts[1]:,} vertices" in capsys.readouterr().out


def test_the_output_is_named_after_the_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert mesh() == 0
    assert (tmp_path / "demo.ply").is_file()


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["-o", "m.png"], "m.png: a mesh is written as .ply, .obj, .stl, .glb"),
        (["--resolution", "4"], "--resolution 4"),
        (["--resolution", "5000"], "--resolution 5000"),
        (["--level", "3"], "--level 3: the model has levels 1 to 2"),
        (["-o", "nowhere/m.ply"], "the folder"),
        (["-o", "/proc/m.ply"], "cannot write"),
    ],
)
def test_bad_input_is_one_line(
    argv: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert mesh(*argv) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert message in err
    assert not list(tmp_path.iterdir())
