"""Noise and outliers of clouds: measurement, removal, and the training weights that depend on noise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mplicits.model.errors import UserError
from mplicits.trainer import level
from mplicits.trainer.config import LossConfig, LossWeights
from mplicits.trainer.shapes.cleaning import clean
from mplicits.trainer.shapes.cloud import CloudShape
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.noise import measured, smoothed
from mplicits.trainer.shapes.outliers import outliers
from mplicits.trainer.shapes.shape import Doubles, SurfacePoints, joined, unit
from mplicits.trainer.training_samples import Pool
from support.ball_training import QUICK, SMALL_SETTINGS, load_ball, train

LOSS = LossConfig()


def ball(count: int = 20_000, noise: float = 0.0, seed: int = 0) -> SurfacePoints:
    rng = np.random.default_rng(seed)
    normals = unit(rng.normal(size=(count, 3)))
    points = normals + rng.normal(scale=noise, size=normals.shape)
    return SurfacePoints(points, unit(normals + rng.normal(scale=noise, size=normals.shape)))


def scattered(count: int, seed: int = 1) -> tuple[Doubles, Doubles]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.5, 1.5, (count, 3)), unit(rng.normal(size=(count, 3)))


def off(points: Doubles) -> float:
    return float(np.sqrt(((np.linalg.norm(points, axis=1) - 1) ** 2).mean()))


@pytest.mark.parametrize("noise", [0.003, 0.01, 0.03])
def test_noise_is_measured(noise: float) -> None:
    cloud = ball(noise=noise)
    assert measured(cloud.points, cloud.normals) == pytest.approx(noise, rel=0.15)


def test_exact_points_have_no_noise() -> None:
    box = trimesh.creation.box((1.0, 1.2, 1.5))
    points, face = trimesh.sample.sample_surface(box, 5000, seed=0)
    for surface in (ball(500), ball(20_000), SurfacePoints(points, np.asarray(box.face_normals[face]))):
        assert measured(surface.points, surface.normals) == 0


def test_smoothing_moves_points_to_the_surface() -> None:
    kept, others = smoothed(ball(noise=0.02), ball(1000, noise=0.02, seed=5), 0.02)
    assert off(kept.surface.points) < 0.02 / 5
    assert off(others.surface.points) < 0.02 / 5
    assert kept.supported.mean() > 0.999


def test_smoothing_keeps_the_sides_of_a_thin_plate_apart() -> None:
    rng, count = np.random.default_rng(0), 8000
    side = rng.choice((-1.0, 1.0), count)
    normals = np.stack((0 * side, 0 * side, side), axis=1)
    points = np.concatenate((rng.uniform(-1, 1, (count, 2)), 0.02 * side[:, None]), axis=1)
    cloud = SurfacePoints(points + rng.normal(scale=0.01, size=points.shape), normals)
    moved = smoothed(cloud, cloud, 0.01)[0].surface.points
    inner = (np.abs(moved[:, :2]) < 0.9).all(axis=1)
    assert np.abs(moved[inner, 2] - 0.02 * side[inner]).max() < 0.015


def test_outliers_are_found_and_sparse_parts_are_kept() -> None:
    cloud, (points, normals) = ball(noise=0.005), scattered(1000)
    found = outliers(np.concatenate((cloud.points, points)), np.concatenate((cloud.normals, normals)))
    assert not found[: len(cloud.points)].any()
    far = np.abs(np.linalg.norm(points, axis=1) - 1) > 0.2
    assert found[len(cloud.points) :][far].mean() > 0.99
    sparse = (cloud.points[:, 0] < 0.5) | (np.random.default_rng(2).random(len(cloud.points)) < 0.04)
    assert not outliers(cloud.points[sparse], cloud.normals[sparse]).any()


def test_cleaning_keeps_exact_points() -> None:
    cloud = ball()
    cleaned = clean(SurfacePoints(3 * cloud.points + 1, cloud.normals), 0.05, None)
    assert (cleaned.noise, cleaned.record) == (0, {})
    assert len(cleaned.training.points) + len(cleaned.held_out.points) == len(cloud.points)
    everything = np.concatenate((cleaned.held_out.points, cleaned.training.points)) * cleaned.scale + cleaned.center
    order = np.random.default_rng(0).permutation(len(cloud.points))
    np.testing.assert_allclose(everything, (3 * cloud.points + 1)[order], atol=1e-12)


@pytest.mark.slow
def test_cleaning_keeps_the_position_and_size_of_a_noisy_cloud(tmp_path: Path) -> None:
    cloud, (points, normals) = ball(noise=0.01), scattered(400)
    everything = np.concatenate((cloud.points, points)), np.concatenate((cloud.normals, normals))
    np.savez(tmp_path / "ball.npz", points=2 * everything[0] + 5, normals=everything[1])
    shape, _ = load_shape(str(tmp_path / "ball.npz"))
    assert shape.scale == pytest.approx(2, rel=0.03)
    np.testing.assert_allclose(shape.center, (5, 5, 5), atol=0.02)
    assert shape.noise == pytest.approx(0.01, rel=0.15)
    assert shape.source["noise"]["measured"]
    assert shape.source["noise"]["outliers"] == pytest.approx(400 / 20_400, rel=0.2)
    assert off(shape.inputs() * shape.scale / 2) < 0.01 / 3
    exact, _ = load_shape(str(tmp_path / "ball.npz"), noise=0.0)
    assert (exact.noise, "noise" in exact.source) == (0, False)
    assert len(exact.inputs()) == round(20_400 * 0.95)


def test_outliers_do_not_determine_the_size_of_a_cloud() -> None:
    everything = joined([ball(4000, noise=0.02), SurfacePoints(*scattered(60))])
    assert clean(everything, 0.05, None).scale < 1.08


def test_noise_option_for_a_mesh_is_refused(tmp_path: Path) -> None:
    trimesh.creation.icosphere().export(tmp_path / "ball.ply")
    with pytest.raises(UserError, match="point clouds"):
        load_shape(str(tmp_path / "ball.ply"), noise=0.01)


def weights(first: bool, noise: float = 0.0, cloud: bool = False) -> LossWeights:
    return LOSS.of_level(first=first, noise=noise, cloud=cloud, moving=False)


@pytest.mark.parametrize(("first", "default"), [(True, LOSS.first_level), (False, LOSS.residual)])
def test_weights_follow_the_noise(first: bool, default: LossWeights) -> None:
    assert weights(first) == default
    weight = weights(first, 0.01)
    assert weight.value * 0.01**2 < weight.eikonal
    assert weight.value > weights(first, 0.02).value
    assert weight.near == LOSS.first_level.near


def test_the_surface_eikonal_weight_is_larger_for_residuals_of_exact_clouds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[LossWeights] = []
    idle_loss = level.idle_loss

    def kept(surface: Pool, volume: Pool, weight: LossWeights) -> float:
        seen.append(weight)
        return idle_loss(surface, volume, weight)

    monkeypatch.setattr(level, "idle_loss", kept)
    quick = replace(SMALL_SETTINGS, steps=(50, 5), texture=False)
    exact, noisy = ball(2000), ball(4000, noise=0.02)
    train(CloudShape(exact, "ball", {}), quick, config=QUICK)
    assert seen == [LOSS.first_level, weights(first=False, cloud=True)]
    assert seen[1].length == LOSS.cloud_length
    train(CloudShape(noisy, "ball", {}), quick, config=QUICK)
    train(load_ball(tmp_path), replace(quick, weights={"value": 7.0}), config=QUICK)
    assert [weight.length for weight in seen[2:]] == [1, 1, 1, 1]
    assert [weight.value for weight in seen[4:]] == [7, 7]


@pytest.mark.slow
def test_distances_near_a_noisy_cloud_and_its_stray_points_are_known() -> None:
    """20,000 points of the unit sphere, 0.025 apart, with single stray points in one region."""
    cloud = ball(noise=0.005)
    sparse = cloud.points[:, 2] > np.cos(0.2)
    kept = ~sparse | (np.random.default_rng(1).uniform(size=len(sparse)) < 0.12)
    shape = CloudShape(cloud.take(kept), "ball", {})
    assert shape.noise > 0
    directions = unit(np.random.default_rng(2).normal(size=(2000, 3)))
    directions[-20:] = unit(directions[-20:] * (0.1, 0.1, 0) + (0, 0, 1))
    radii = np.repeat([0.86, 1.0, 1.14], [900, 200, 900])
    center, scale = np.array(shape.center), shape.scale
    distance = scale * shape.distance((directions * radii[:, None] - center) / scale)
    assert np.isnan(distance[900:1100]).all(), "next to a point its distance is not that of the surface"
    np.testing.assert_allclose(distance[:900][directions[:900, 2] < np.cos(0.4)], -0.14, atol=0.025)
    assert not np.isnan(distance[1100:]).any()
    above = directions[1100:, 2] > np.cos(0.2)
    np.testing.assert_allclose(distance[1100:][~above], 0.14, atol=0.025)
