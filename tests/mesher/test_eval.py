"""`mplicits eval`: each figure agrees with an independent computation, and the verb prints what it should."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.mesher.compare import compare
from mplicits.mesher.metrics import VOXEL, SampledSurface, shell_iou
from mplicits.mesher.read_meshes import in_model_space, normalization, read_mesh
from mplicits.mesher.surface import Mesh
from mplicits.model.model_file import load
from support.paths import DEMO

ORIGIN = (0.0, 0.0, 0.0)


def ball(radius: float, subdivisions: int = 5) -> Mesh:
    """An icosphere about the origin."""
    return in_model_space(trimesh.creation.icosphere(subdivisions, radius), ORIGIN, 1.0)


def test_concentric_balls_are_as_far_apart_as_their_radii() -> None:
    gap = 0.04
    figures = compare(ball(0.9), ball(0.9 - gap), samples=40_000)
    assert figures.chamfer == pytest.approx(2 * gap**2 + figures.floor, rel=0.05)
    assert figures.distance_mean == pytest.approx(gap, rel=0.02)
    assert figures.missing_99 == pytest.approx(gap, rel=0.02)
    assert figures.hausdorff == pytest.approx(gap, rel=0.03)
    assert figures.normal_angle < 2
    assert figures.iou == 0
    assert (figures.components, figures.truth_components, figures.watertight) == (1, 1, True)


def test_the_same_surface_is_at_the_floor() -> None:
    figures = compare(ball(0.9), ball(0.9), samples=20_000)
    assert figures.chamfer == pytest.approx(figures.floor, rel=0.03)
    assert figures.hausdorff < 1e-6
    assert figures.iou == 1
    expected = 2 / (np.pi * 20_000 / (4 * np.pi * 0.9**2))
    assert figures.floor == pytest.approx(expected, rel=0.05), "nearest of n points on area A: E d^2 = A / (pi n)"


def test_shells_overlap_as_their_volumes_do() -> None:
    one, other = SampledSurface(ball(0.6)), SampledSurface(ball(0.61))
    samples = np.concatenate([surface.sample(100_000, np.random.default_rng(0))[0] for surface in (one, other)])
    # Shells of radii (0.59, 0.61) and (0.60, 0.62): the common part over the union, by their volumes.
    volumes = [high**3 - low**3 for low, high in ((0.60, 0.61), (0.59, 0.62))]
    assert pytest.approx(0.01) == VOXEL
    assert shell_iou(one, other, samples) == pytest.approx(volumes[0] / volumes[1], abs=0.03)


def test_components_and_holes_are_counted() -> None:
    one = trimesh.creation.icosphere(3, 0.3)
    two = trimesh.Trimesh(
        np.concatenate((one.vertices, np.add(one.vertices, (0.7, 0, 0)))),
        np.concatenate((one.faces, one.faces + len(one.vertices))),
    )
    open_ball = trimesh.creation.icosphere(3, 0.3)
    open_ball.update_faces(np.arange(len(open_ball.faces)) > 4)
    figures = compare(in_model_space(two, ORIGIN, 1.0), in_model_space(open_ball, ORIGIN, 1.0), samples=1000)
    assert (figures.components, figures.truth_components, figures.watertight) == (2, 1, True)
    assert not compare(in_model_space(open_ball, ORIGIN, 1.0), ball(0.3), samples=1000).watertight


def test_the_seed_decides_the_samples() -> None:
    first, again, other = (asdict(compare(ball(0.9, 3), ball(0.8, 3), 2000, seed)) for seed in (1, 1, 2))
    assert first == again
    assert first["chamfer"] != other["chamfer"]


@pytest.fixture
def truth(tmp_path: Path) -> Path:
    """A mesh file of the demo model's own surface, in input space."""
    model = load(DEMO)
    path = tmp_path / "truth.ply"
    assert cli.main(["mesh", str(DEMO), "-o", str(path), "--resolution", "100", "--quiet"]) == 0
    assert model.scale > 0
    return path


@pytest.mark.slow
def test_a_model_is_at_the_floor_against_its_own_mesh(truth: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    argv = ["eval", str(DEMO), str(truth), "--resolution", "64", "--samples", "10000", "--quiet"]
    assert cli.main([*argv, "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["chamfer"] == pytest.approx(figures["floor"], rel=0.2)
    assert figures["distance_mean"] < 3e-3
    assert figures["iou"] > 0.8
    assert figures["resolution"] == 64
    assert cli.main(argv) == 0
    text = capsys.readouterr().out
    assert f"{figures['chamfer']:.3e}" in text
    assert "times the floor" in text
    assert 0 < figures["field"]["domain_error"] < 0.1
    assert 0 < figures["field"]["band_error"] < 2e-2
    low, middle, high = figures["field"]["gradient"]
    assert 0 < low < middle < high
    assert f"{figures['field']['band_error']:.3e}" in text


def test_a_mesh_is_compared_with_a_mesh(truth: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    moved = read_mesh(truth)
    moved.vertices = moved.vertices * 7.0 + (3.0, 2.0, 1.0)
    center, scale = normalization(moved)
    assert np.linalg.norm(np.asarray(moved.vertices) - center, axis=1).max() == pytest.approx(scale)
    moved.export(tmp_path / "moved.obj")
    capsys.readouterr()
    argv = ["eval", str(tmp_path / "moved.obj"), str(tmp_path / "moved.obj"), "--samples", "5000", "--quiet", "--json"]
    assert cli.main(argv) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["hausdorff"] < 1e-6
    assert "field" not in figures, "a mesh has none"
    assert cli.main([*argv, "--resolution", "64"]) == 2
    assert "is a mesh already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (None, "none.ply", "no such file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(64), "picture.png", "not a mesh by its suffix"),
        (b"\x89PNG\r\n\x1a\n" + bytes(64), "picture.ply", "not a readable PLY file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "picture.obj", "not a readable OBJ"),
    ],
)
def test_bad_input_is_one_line(
    content: bytes | None, name: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert cli.main(["eval", str(DEMO), str(tmp_path / name), "--quiet"]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert message in err


@pytest.mark.parametrize("argv", [["--samples", "5"], ["--seed", "-1"], ["--resolution", "2"], ["--level", "9"]])
def test_numbers_out_of_range_are_one_line(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["eval", str(DEMO), "nothing.ply", *argv]) == 2
    assert argv[0] in capsys.readouterr().err
