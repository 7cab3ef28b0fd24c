"""Clouds: distances from local planes, duplicates, and extreme numbers."""

import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from mplicits.model.errors import UserError
from mplicits.trainer.shapes.cloud import CloudShape
from mplicits.trainer.shapes.duplicates import merge
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, SurfacePoints, unit


def on_ball(count: int = 4000) -> Doubles:
    return unit(np.random.default_rng(0).normal(size=(count, 3)))


def cloud(points: Doubles, normals: Doubles, colors: Doubles | None = None) -> CloudShape:
    return CloudShape(SurfacePoints(points, normals, colors), "cloud", {})


def on_torus(count: int) -> tuple[Doubles, Doubles]:
    """Points of a torus of radii 0.75 and 0.25, and their normals."""
    around, along = np.random.default_rng(1).uniform(0, 2 * np.pi, (2, count))
    ring = np.stack((np.cos(around), np.sin(around), 0 * around), axis=1)
    normals = ring * np.cos(along)[:, None] + np.sin(along)[:, None] * np.array((0, 0, 1.0))
    return 0.75 * ring + 0.25 * normals, normals


def torus_distance(points: Doubles) -> Doubles:
    return np.asarray(np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.75, points[:, 2]) - 0.25)


def test_near_the_points_planes_are_more_accurate_than_the_nearest_point() -> None:
    points, normals = on_torus(8000)
    shape = cloud(points, normals)
    random = np.random.default_rng(2)
    query = points[:4000] + random.uniform(-0.03, 0.03, (4000, 3))
    truth = torus_distance(query * shape.scale + shape.center) / shape.scale
    distance = shape.distance(query)
    error = np.abs(distance - truth)
    assert np.isnan(distance).mean() < 0.02
    nearest = cKDTree(points / shape.scale - np.array(shape.center) / shape.scale).query(query)[0]
    assert np.nanmean(error) < 0.05 * np.abs(nearest - np.abs(truth)).mean()
    assert np.nanmax(error) < 0.01
    assert not (distance * truth < 0)[np.abs(truth) > 2e-3].any()


def test_distances_in_a_hole_of_the_cloud_are_unknown() -> None:
    points = on_ball(20_000)
    points = points[points[:, 2] < 0.8]
    shape = cloud(points, points)
    middle = (np.array(((0, 0, 0.8),)) - shape.center) / shape.scale
    assert np.isnan(shape.distance(middle)).all()
    assert shape.distance(np.zeros((1, 3)))[0] < -0.5


def test_distances_near_contradictory_normals_are_unknown() -> None:
    random = np.random.default_rng(4)
    shape = cloud(random.uniform(-1, 1, (3000, 3)), unit(random.normal(size=(3000, 3))))
    assert np.isnan(shape.distance(random.uniform(-0.5, 0.5, (2000, 3)))).mean() > 0.4


def test_duplicates_are_merged() -> None:
    points, colors = on_ball(300), np.tile((0.2, 0.4, 0.6), (300, 1))
    near = points + 1e-12
    tilted = unit(points + 0.1 * np.roll(points, 1, axis=1))
    result = merge(
        SurfacePoints(
            np.concatenate((points, near, points)),
            np.concatenate((points, tilted, points)),
            np.concatenate((colors, colors + 0.3, colors)),
        )
    )
    assert (result.merged, result.dropped) == (600, 0)
    np.testing.assert_array_equal(result.surface.points, points)
    np.testing.assert_allclose(result.surface.normals, unit(2 * points + tilted))
    assert result.surface.colors is not None
    np.testing.assert_allclose(result.surface.colors, colors + 0.1)


def test_duplicates_with_opposite_normals_are_dropped() -> None:
    points = on_ball(300)
    result = merge(SurfacePoints(np.concatenate((points, points[:7])), np.concatenate((points, -points[:7]))))
    assert (result.merged, result.dropped) == (7, 7)
    np.testing.assert_array_equal(result.surface.points, points[7:])


def test_a_chain_of_close_points_is_not_merged_to_one() -> None:
    """Each point of the chain is a duplicate of the next one, but not of the one after."""
    line = np.zeros((5000, 3))
    line[:, 0] = np.linspace(0, 1, 5000) * 2e-3
    points = np.concatenate((line, [(2, 0, 0)]))
    result = merge(SurfacePoints(points, np.tile((0, 0, 1.0), (len(points), 1))))
    gaps = np.diff(np.sort(result.surface.points[:, 0]))
    assert gaps.min() > 0.99e-6
    assert len(gaps) > 900


def test_a_warning_says_how_many_points_were_merged() -> None:
    points = np.repeat(on_ball(300), 2, axis=0)
    shape = cloud(points, points)
    assert len(shape.warnings) == 1
    assert "merged 300 points" in shape.warnings[0]


CASES = """
import numpy as np
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import unit
random = np.random.default_rng(0)
ball = unit(random.normal(size=(2000, 3)))
flat, thin = random.uniform(-1, 1, (2, 2000, 3))
flat[:, 2], thin[:, 1:] = 0, 0
cases = {
    "thrice": np.concatenate((ball, ball[:1], ball[:1])),
    "twice": np.repeat(ball, 2, axis=0),
    "nearly twice": np.concatenate((ball, ball + 1e-12)),
    "in one plane": flat,
    "in one line": thin,
    "cluster": np.concatenate((ball, 1e-9 * ball)),
    "far away": 1e6 + ball,
    "large": 1e90 * ball,
    "small": 1e-90 * ball,
    "on a grid": np.stack(np.meshgrid(*[np.arange(12.0)] * 3), axis=-1).reshape(-1, 3),
    "columns": np.concatenate([ball[:300] * (1 + 0.03 * random.normal(size=(300, 1))) for _ in range(40)]),
}
for name, points in cases.items():
    np.savez("cloud.npz", points=points, normals=unit(points + (0, 0, 1e-3 * abs(points).max())))
    shape, _ = load_shape("cloud.npz")
    values = shape.distance(random.uniform(-1, 1, (500, 3)))
    assert (np.isnan(values) | (np.abs(values) < 4)).all(), name
    print(name)
"""


@pytest.mark.slow
def test_no_arrangement_of_points_crashes_the_process(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))

    command = [sys.executable, "-c", CASES]
    done = subprocess.run(command, check=False, cwd=tmp_path, preexec_fn=limit, capture_output=True, text=True)
    assert done.returncode == 0, f"after {done.stdout.split()}: {done.stderr}"


def refusal(path: Path) -> str:
    with pytest.raises(UserError) as refused:
        load_shape(str(path))
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith(path.name)
    return str(refused.value)


@pytest.mark.parametrize(("size", "says"), [(1e200, "scale it down"), (1e-200, "scale it up")])
def test_coordinates_that_overflow_when_squared_are_refused(tmp_path: Path, size: float, says: str) -> None:
    np.savez(tmp_path / "cloud.npz", points=size * on_ball(200), normals=on_ball(200))
    np.savetxt(tmp_path / "cloud.xyz", np.concatenate((size * on_ball(200), on_ball(200)), axis=1))
    mesh = trimesh.creation.icosphere(subdivisions=1)
    rows = [f"v {' '.join(f'{x:.9g}' for x in size * vertex)}" for vertex in mesh.vertices]
    (tmp_path / "mesh.obj").write_text("\n".join([*rows, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces)]))
    for name in ("cloud.npz", "cloud.xyz", "mesh.obj"):
        assert says in refusal(tmp_path / name)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_colors_that_are_not_finite_are_refused(tmp_path: Path, value: float) -> None:
    colors = np.full((200, 3), 0.5)
    colors[7, 1] = value
    np.savez(tmp_path / "cloud.npz", points=on_ball(200), normals=on_ball(200), colors=colors)
    np.savetxt(tmp_path / "cloud.xyz", np.concatenate((on_ball(200), on_ball(200), 255 * colors), axis=1))
    for name in ("cloud.npz", "cloud.xyz"):
        assert "colors are not finite" in refusal(tmp_path / name)


def test_normals_too_long_to_measure_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "cloud.npz", points=on_ball(200), normals=1e200 * on_ball(200))
    assert "too long" in refusal(tmp_path / "cloud.npz")


def test_a_noise_option_that_rejects_all_points_is_refused(tmp_path: Path) -> None:
    noisy = on_ball(2000) * np.random.default_rng(0).normal(1, 0.02, (2000, 1))
    np.savez(tmp_path / "cloud.npz", points=noisy, normals=noisy)
    with pytest.raises(UserError, match=r"^cloud\.npz: 0 points are left after removing noise of 1e-06"):
        load_shape(str(tmp_path / "cloud.npz"), noise=1e-6)


def ball_and_duplicated_ball() -> tuple[CloudShape, CloudShape]:
    points = on_ball(3000)
    return cloud(points, points), cloud(np.tile(points, (2, 1)), np.tile(points, (2, 1)))


def test_duplicating_every_point_keeps_the_shape() -> None:
    once, twice = ball_and_duplicated_ball()
    for held_out in (False, True):
        one, other = (shape.surface(500, np.random.default_rng(5), held_out=held_out) for shape in (once, twice))
        np.testing.assert_array_equal(one.points, other.points)
        np.testing.assert_allclose(one.normals, other.normals, atol=1e-12)
    query = np.random.default_rng(5).uniform(-1, 1, (1000, 3))
    np.testing.assert_allclose(once.distance(query), twice.distance(query), atol=1e-9)


def test_few_points_tell_inside_from_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    """The winding number takes 32 kB a point."""
    monkeypatch.setattr("mplicits.trainer.shapes.cloud.MOST_COARSE", 300)
    normals = unit(np.random.default_rng(0).normal(size=(3000, 3)))
    shape = CloudShape(SurfacePoints(normals, normals, None), "ball", {})
    assert len(shape._winding[0]) <= 300
    far = unit(np.random.default_rng(1).normal(size=(500, 3)))
    for radius in (0.3, 0.6, 1.4):
        found = shape.distance(radius * far)
        known = ~np.isnan(found)
        assert known.mean() > 0.9
        np.testing.assert_allclose(found[known], radius - 1, atol=0.03)
