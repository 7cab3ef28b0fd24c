"""The figures agree with trimesh and with brute force on other samples, on voxels and triangles one by one."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from mplicits.mesher.compare import compare, is_watertight
from mplicits.mesher.metrics import VOXEL, SampledSurface, angles, shell_iou
from mplicits.mesher.surface import Mesh

SAMPLES = 1500
BOX = trimesh.creation.box()


def mesh(vertices: object, faces: object) -> Mesh:
    """A mesh of vertices (V, 3) and faces (F, 3), whatever their types."""
    return Mesh(np.asarray(vertices, np.float32), np.asarray(faces, np.int64))


def measured(of: trimesh.Trimesh, to: trimesh.Trimesh) -> tuple[NDArray[np.float64], ...]:
    """Sample one surface and measure each sample against another surface.

    Returns the distance to the surface, the squared distance to the nearest of as many samples of it, and the angle of
    the normals in degrees: (SAMPLES,) each.
    """
    points, faces = trimesh.sample.sample_surface(of, SAMPLES, seed=1)
    others, _ = trimesh.sample.sample_surface(to, SAMPLES, seed=2)
    _, distance, nearest = trimesh.proximity.closest_point_naive(to, points)  # type: ignore[no-untyped-call]
    squared = ((points[:, None] - others[None]) ** 2).sum(axis=2).min(axis=1)
    cosine = np.einsum("ij,ij->i", of.face_normals[faces], to.face_normals[nearest])
    return np.asarray(distance), squared, np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def test_figures_agree_with_an_independent_computation() -> None:
    """The samples of both computations are not the same, so the figures differ as much as those of two samplings do."""
    one = trimesh.creation.icosphere(subdivisions=2, radius=0.9)
    one.vertices *= (1.0, 0.7, 0.5)
    other = trimesh.creation.box((1.2, 0.9, 0.6))
    figures = compare(mesh(one.vertices, one.faces), mesh(other.vertices, other.faces), SAMPLES)
    distance, there, angle = measured(one, other)
    missing, back, _ = measured(other, one)
    assert figures.chamfer == pytest.approx(there.mean() + back.mean(), rel=0.08)
    assert figures.hausdorff == pytest.approx(max(distance.max(), missing.max()), rel=0.05)
    assert figures.distance_mean == pytest.approx(distance.mean(), rel=0.06)
    assert figures.distance_99 == pytest.approx(np.quantile(distance, 0.99), rel=0.06)
    assert figures.missing_mean == pytest.approx(missing.mean(), rel=0.06)
    assert figures.missing_99 == pytest.approx(np.quantile(missing, 0.99), rel=0.06)
    assert figures.normal_angle == pytest.approx(angle.mean(), rel=0.06)
    assert figures.distance_mean != pytest.approx(missing.mean(), rel=0.1)  # the two directions can be told apart
    assert (figures.vertices, figures.faces) == (len(one.vertices), len(one.faces))


def test_a_mesh_inside_out_has_opposite_normals() -> None:
    turned = compare(mesh(BOX.vertices, BOX.faces[:, ::-1]), mesh(BOX.vertices, BOX.faces), 500)
    assert turned.normal_angle == pytest.approx(180)
    slight = np.array([[np.cos(1e-3), np.sin(1e-3), 0.0]])
    assert angles(slight, np.array([[1.0, 0, 0]])) == pytest.approx(np.degrees(1e-3), rel=1e-6)


def test_the_floor_depends_on_the_truth_and_the_seed_alone() -> None:
    truth, ball = mesh(BOX.vertices, BOX.faces), trimesh.creation.icosphere(1)
    figures = [compare(given, truth, 1000, 3) for given in (truth, mesh(ball.vertices, ball.faces))]
    assert figures[0].floor == figures[1].floor != compare(truth, truth, 1000, 4).floor
    assert figures[0].chamfer != figures[1].chamfer


def test_samples_are_uniform_in_a_triangle() -> None:
    corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 1, 0]])
    points, _ = SampledSurface(mesh(corners, [[0, 1, 2]])).sample(40_000, np.random.default_rng(0))
    assert points.mean(axis=0) == pytest.approx(corners.mean(axis=0), abs=0.015)
    # Of the uniform distribution over a triangle: the corners' deviations d give the covariance d^T d / 12.
    deviations = corners - corners.mean(axis=0)
    np.testing.assert_allclose(np.cov(points.T), deviations.T @ deviations / 12, atol=0.015)


def test_a_triangle_without_area_is_no_surface() -> None:
    given = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], [[3, 3, 3], [0, 1, 2], [0, 3, 0]])
    surface = SampledSurface(given)
    distance, face = surface.distance(np.array([[9.0, 9.0, 9.0], [0.2, 0.2, -3.0]]))
    np.testing.assert_allclose(distance, [np.sqrt(8.5**2 + 8.5**2 + 9**2), 3])
    assert (surface.normals[face] == (0, 0, 1)).all()
    points, face = surface.sample(100, np.random.default_rng(0))
    assert (surface.normals[face] == (0, 0, 1)).all()
    assert (points[:, 2] == 0).all()


@pytest.mark.slow
def test_the_iou_of_shells_is_what_a_test_of_all_voxels_counts() -> None:
    one, other = BOX.copy().apply_scale((0.08, 0.06, 0.04)), trimesh.creation.icosphere(2, 0.043)
    other.apply_translation((-0.013, 0.004, 0.002))  # voxels on both sides of zero
    a, b = (SampledSurface(mesh(shape.vertices, shape.faces)) for shape in (one, other))
    axis = (np.arange(-10, 10) + 0.5) * VOXEL
    centers = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    shells = []
    for shape in (one, other):
        _, distance, _ = trimesh.proximity.closest_point_naive(shape, centers)  # type: ignore[no-untyped-call]
        shells.append(np.asarray(distance) <= VOXEL)
    samples = np.concatenate([surface.sample(20_000, np.random.default_rng(0))[0] for surface in (a, b)])
    expected = (shells[0] & shells[1]).sum() / (shells[0] | shells[1]).sum()
    assert 0.1 < expected < 0.9
    assert shell_iou(a, b, samples) == pytest.approx(expected, abs=1e-3)


def test_shells_far_apart_take_no_memory() -> None:
    near, far = (SampledSurface(mesh(BOX.vertices * 0.02 + shift, BOX.faces)) for shift in (0, 99))
    samples = np.concatenate([surface.sample(1000, np.random.default_rng(0))[0] for surface in (near, far)])
    assert shell_iou(near, far, samples) == 0
    assert shell_iou(far, far, samples) == 1


@pytest.mark.parametrize(
    ("faces", "watertight"),
    [
        (BOX.faces, True),
        (BOX.faces[1:], False),
        ([*BOX.faces[1:], BOX.faces[0][::-1]], False),
        ([*BOX.faces, *BOX.faces[:, ::-1]], False),
        ([*BOX.faces, *(BOX.faces + 8)], True),
    ],
    ids=["box", "hole", "one face turned", "four faces at an edge", "two boxes"],
)
def test_a_mesh_is_watertight_where_every_edge_has_two_faces(faces: object, watertight: bool) -> None:
    assert is_watertight(np.asarray(faces, np.int64)) == watertight
