"""Moving shapes: samples, distances, and training."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits import cli
from mplicits.field.interpret import color, nested_field
from mplicits.ir.lower import lower
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes import motion
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.mesh import MeshShape
from mplicits.trainer.shapes.motion import Moment, MovingShape, common_place, placed
from mplicits.trainer.shapes.shape import Doubles
from support.ball_training import train

RED, BLUE = (255, 0, 0), (0, 0, 255)


def write_ball(path: Path, radius: float, color: tuple[int, int, int] | None = None, x: float = 0.0) -> Path:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    mesh.apply_translation((x, 0, 0))
    if color is not None:
        mesh.visual.vertex_colors = np.array([*color, 255], np.uint8)
    mesh.export(path)
    return path


def mesh_shape(path: Path) -> MeshShape:
    shape = load_shape(str(path))[0]
    assert isinstance(shape, MeshShape)
    return shape


def moment(path: Path, factor: float) -> Moment:
    return Moment(mesh_shape(path), np.zeros(3), factor)


@pytest.fixture(autouse=True)
def coarse_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion, "CELLS", 24)
    monkeypatch.setattr(motion, "SURFACES", 4)


@pytest.fixture
def growing(tmp_path: Path) -> MovingShape:
    """A ball whose radius grows from 0.4 to 0.8 while its color changes from red to blue."""
    ends = [write_ball(tmp_path / "a.ply", 1, RED), write_ball(tmp_path / "b.ply", 1, BLUE)]
    moments = [moment(path, factor) for path, factor in zip(ends, (0.4, 0.8), strict=True)]
    return MovingShape(moments, "ball", {"moments": []}, (0.0, 0.0, 0.0), 1.0, surfaces=8)


def radius(times: Doubles) -> Doubles:
    return 0.4 + 0.4 * times


def test_samples_lie_on_the_surface_of_their_time(growing: MovingShape) -> None:
    drawn = growing.surface(4000, np.random.default_rng(0), colors=True)
    times = drawn.points[:, 3]
    assert set(np.unique(times)) == set(np.arange(9) / 8)
    assert (times == 0).mean() == pytest.approx(6 / 19, abs=0.05), "the moments have most of them"
    at = drawn.points[:, :3]
    assert np.abs(np.linalg.norm(at, axis=1) - radius(times)).max() < 0.06
    assert (drawn.normals * at).sum(axis=1).min() > 0.9 * 0.36
    assert drawn.colors is not None
    assert np.abs(drawn.colors - np.column_stack((1 - times, 0 * times, times))).max() < 0.01
    assert np.abs(growing.distance(drawn.points)).max() < 1e-6
    inputs = growing.inputs()
    assert set(np.unique(inputs[:, 3])) == set(np.arange(9) / 8)


def test_distances_are_interpolated_in_time(growing: MovingShape) -> None:
    rng = np.random.default_rng(1)
    points = np.column_stack((rng.uniform(-0.9, 0.9, (2000, 3)), rng.random(2000)))
    truth = np.linalg.norm(points[:, :3], axis=1) - radius(points[:, 3])
    assert np.abs(growing.distance(points) - truth).max() < 0.06


def test_moments_keep_their_positions_in_the_common_space(tmp_path: Path) -> None:
    shapes = [mesh_shape(write_ball(tmp_path / f"{x}.ply", 1, x=x)) for x in (5.0, 7.0)]
    center, scale = common_place(shapes)
    assert center == pytest.approx((6, 0, 0), abs=1e-6)
    assert scale == pytest.approx(2, abs=0.01)
    for shape, x in zip(shapes, (-0.5, 0.5), strict=True):
        there = placed(shape, center, scale)
        points = there.surface(500, np.random.default_rng(0)).points
        assert np.linalg.norm(points - (x, 0, 0), axis=1) == pytest.approx(0.5, abs=0.02)
        assert there.distance(np.array([[x, 0.0, 0.0]])) == pytest.approx(-0.5, abs=0.01)


@pytest.mark.slow
def test_training_learns_a_motion_and_its_colors(growing: MovingShape) -> None:
    settings = Settings(networks=((16, 1), (16, 1)), omegas=(6.0, 12.0), steps=(500, 400, 200))
    model = train(growing, settings)
    assert model.inputs == "xyzt"
    program, directions = lower(model), np.random.default_rng(0).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for time in (0.0, 0.3, 0.7, 1.0):
        at = (directions * (0.4 + 0.4 * time)).astype(np.float32)
        value, reached = nested_field(program, at, 2, time)
        assert (reached == 2).all(), "the band holds the surface at every time"
        assert np.abs(value).mean() < 0.01
        assert np.abs(color(program, at, time) - (1 - time, 0, time)).mean() < 0.1


def run(*argv: object) -> int:
    return cli.main([str(argument) for argument in argv])


def test_bad_moments_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ball, cloud = write_ball(tmp_path / "ball.ply", 1), tmp_path / "cloud.xyz"
    np.savetxt(cloud, np.tile(np.random.default_rng(0).normal(size=(200, 3)), 2))
    output = ("-o", tmp_path / "m.safetensors")
    refused: list[tuple[tuple[object, ...], str]] = [
        (("morph", ball, cloud, *output), "a point cloud"),
        (("morph", ball, tmp_path / "none.ply", *output), "no such file"),
        (("morph", ball, ball, "-o", ball), "it is the input"),
        (("morph", ball, ball, *output, "--texture", "x.png"), "--texture"),
        (("train", ball, "--time", *output), "not a folder"),
        (("train", tmp_path, "--time", *output), "1 meshes"),
    ]
    for argv, message in refused:
        assert run(*argv, "--quiet") == 2
        error = capsys.readouterr().err.splitlines()
        assert message in error[-1], error
    assert not output[1].exists()
