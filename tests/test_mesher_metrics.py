"""Distances between surfaces against brute force, trimesh and formulas."""

import numpy as np
import pytest
import trimesh

from mesher.metrics import VOXEL, Doubles, Surface, angles, chamfer, shell_overlap, topology
from mesher.surface import Mesh


def mesh(vertices: object, faces: object) -> Mesh:
    return Mesh(np.asarray(vertices, np.float32), np.asarray(faces, np.int64))


def of_trimesh(given: trimesh.Trimesh) -> Mesh:
    return mesh(given.vertices, given.faces)


def squared_to_nearest(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray((((a[:, None] - b[None]) ** 2).sum(axis=2)).min(axis=1))


TRIANGLE = mesh([[0, 0, 0], [3, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_chamfer_is_that_of_brute_force() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(300, 3)), rng.normal(size=(200, 3))
    wanted = squared_to_nearest(a, b).mean(), squared_to_nearest(b, a).mean()
    assert chamfer(a, b) == pytest.approx(wanted, rel=1e-12)
    assert wanted[0] != pytest.approx(wanted[1], rel=1e-2)


def test_distance_and_normal_are_those_of_trimesh() -> None:
    rng = np.random.default_rng(0)
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.vertices *= (1.0, 0.6, 0.3)
    points = rng.normal(size=(200, 3))
    _, wanted, nearest = trimesh.proximity.closest_point_naive(ball, points)
    distance, normals = Surface(of_trimesh(ball)).nearest(points)
    assert distance == pytest.approx(wanted, abs=1e-6)
    # Where the nearest place is on an edge or a corner, any of its faces will do.
    same = np.einsum("ij,ij->i", normals, ball.face_normals[nearest]) > 1 - 1e-9
    assert same.mean() > 0.4
    inner = ball.triangles_center + 1e-3 * ball.face_normals
    distance, normals = Surface(of_trimesh(ball)).nearest(inner)
    assert distance == pytest.approx(1e-3, abs=1e-6)
    assert np.einsum("ij,ij->i", normals, ball.face_normals) == pytest.approx(1, abs=1e-6)


def test_samples_are_uniform_in_a_triangle() -> None:
    samples = Surface(TRIANGLE).sample(40_000, np.random.default_rng(0))
    assert samples.points.mean(axis=0) == pytest.approx([1, 1 / 3, 0], abs=0.015)
    # Of the uniform distribution over a triangle: the corners' deviations d give the covariance d^T d / 12.
    corners = TRIANGLE.vertices.astype(np.float64)
    deviations = corners - corners.mean(axis=0)
    assert np.cov(samples.points.T) == pytest.approx(deviations.T @ deviations / 12, abs=0.015)
    assert (samples.points[:, :2] >= 0).all()
    assert (samples.points @ (1 / 3, 1, 0) <= 1 + 1e-12).all()
    assert (samples.normals == (0, 0, 1)).all()


def test_samples_are_uniform_by_area() -> None:
    # 1 part of 10 of the area in the first triangle, and none of it in the one that is a line.
    given = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5], [9, 0, 5], [0, 1, 5], [5, 5, 5], [6, 6, 6], [7, 7, 7]],
                 [[0, 1, 2], [6, 7, 8], [3, 4, 5]])
    points = Surface(given).sample(20_000, np.random.default_rng(0)).points
    assert set(points[:, 2]) == {0.0, 5.0}
    assert (points[:, 2] == 0).mean() == pytest.approx(0.1, abs=0.01)


def test_a_triangle_without_area_is_no_surface() -> None:
    given = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], [[3, 3, 3], [0, 1, 2], [0, 3, 0]])
    distance, normals = Surface(given).nearest(np.array([[9.0, 9.0, 9.0], [0.2, 0.2, -3.0]]))
    assert distance == pytest.approx([np.sqrt(8.5**2 + 8.5**2 + 9**2), 3])
    assert (normals == (0, 0, 1)).all()
    assert len(Surface(given).vertices) == 3


def test_angles() -> None:
    a = np.array([[1.0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]])
    b = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [np.cos(1e-5), np.sin(1e-5), 0], [0.5, 0, -np.sqrt(0.75)]])
    assert angles(a, b) == pytest.approx([0, 90, 180, np.degrees(1e-5), 60], rel=1e-9, abs=1e-12)


def test_shells_share_the_voxels_that_both_touch() -> None:
    a = VOXEL * np.array([[0.5, 0.5, 0.5], [0.9, 0.1, 0.2], [-0.5, 0.5, 0.5], [-0.5, -99.5, 50.5]])
    b = VOXEL * np.array([[0.1, 0.9, 0.9], [-0.9, 0.2, 0.2], [0.5, 1.5, 0.5]])
    assert shell_overlap(a, b) == pytest.approx(2 / 4)  # the voxels at 0 and at -1; one more in each
    assert shell_overlap(a, a[::-1]) == 1
    assert shell_overlap(a, b + 1) == 0


def test_voxels_of_random_points_are_counted_as_sets_count_them() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.uniform(-0.1, 0.1, (2, 3000, 3))
    ours, theirs = (set(map(tuple, np.floor(points / VOXEL).astype(int).tolist())) for points in (a, b))
    assert shell_overlap(a, b) == pytest.approx(len(ours & theirs) / len(ours | theirs), rel=1e-12)


BOX = trimesh.creation.box()


@pytest.mark.parametrize(("given", "components", "watertight"), [
    (of_trimesh(BOX), 1, True),
    (mesh(BOX.vertices, BOX.faces[1:]), 1, False),
    (mesh(BOX.vertices, [*BOX.faces[1:], BOX.faces[0][::-1]]), 1, False),
    (mesh([*BOX.vertices, (9, 9, 9)], BOX.faces), 1, True),
    (mesh([*BOX.vertices, *(BOX.vertices + 3)], [*BOX.faces, *(BOX.faces + 8)]), 2, True),
    (mesh([*BOX.vertices, *BOX.vertices], [*BOX.faces, *(BOX.faces + 8)]), 2, True),
    (mesh(BOX.vertices, [*BOX.faces, *BOX.faces[:, ::-1]]), 1, False),
    (TRIANGLE, 1, False),
], ids=["box", "hole", "one face turned", "stray vertex", "two", "two at one place", "four faces at an edge", "open"])
def test_topology(given: Mesh, components: int, watertight: bool) -> None:
    found = topology(given)
    assert (found.components, found.watertight) == (components, watertight)
    assert (found.vertices, found.faces) == (len(given.vertices), len(given.faces))
