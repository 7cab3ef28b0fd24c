"""Dithering and offsets (Fig. 3a, 3b) on shapes whose distances are known."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from mplicits.model.errors import UserError
from mplicits.trainer import sampling
from mplicits.trainer.shapes.shape import Doubles, unit


def sphere(points: Doubles) -> Doubles:
    """Compute the signed distance to a sphere of radius 0.5."""
    return np.asarray(np.linalg.norm(points, axis=1) - 0.5)


def on_sphere(count: int) -> Doubles:
    return 0.5 * unit(np.random.default_rng(0).normal(size=(count, 3)))


def test_offsets_outside_a_sphere_take_the_whole_band() -> None:
    points = on_sphere(200)
    assert (sampling.offsets(points, unit(points), 0.2, lambda x: np.abs(sphere(x))) == 0.2).all()


def test_offsets_inside_a_sphere_stop_at_its_centre() -> None:
    points = on_sphere(200)
    t = sampling.offsets(points, -unit(points), 0.8, lambda x: np.abs(sphere(x)))
    np.testing.assert_allclose(t, 0.48, atol=1e-12)  # the largest of 0.8 * k / 10 within the radius, 0.5


def test_offset_points_keep_their_distance_to_a_cloud() -> None:
    rng = np.random.default_rng(1)
    # Two planes face each other 0.1 apart, so that points may move 0.05 along their normals, not 0.2.
    points = rng.uniform(-1, 1, (8000, 3))
    points[:, 2] = np.where(np.arange(8000) % 2, 0.0, 0.1)
    normals = np.zeros_like(points)
    normals[:, 2] = np.where(np.arange(8000) % 2, 1.0, -1.0)
    tree = cKDTree(points)
    t = sampling.offsets(points, normals, 0.2, lambda x: np.asarray(tree.query(x)[0]))
    distance = np.asarray(tree.query(points + t[:, None] * normals)[0])
    assert np.min(distance - t * (1 - sampling.TOLERANCE)) > -1e-12
    assert np.max(distance - t) < 1e-12
    assert 0.03 < t.mean() < 0.07


def test_dithered_samples_are_in_the_band_and_fill_it() -> None:
    delta = 0.05
    drawn = sampling.dithered(
        on_sphere(500), delta, lambda x: np.abs(sphere(x)) < delta, 3000, np.random.default_rng(0)
    )
    assert drawn.shape == (3000, 3)
    assert (np.abs(sphere(drawn)) < delta).all()
    assert sphere(drawn).min() < -0.9 * delta
    assert sphere(drawn).max() > 0.9 * delta


def test_dithering_stays_within_two_delta_of_a_point() -> None:
    points = on_sphere(500)
    drawn = sampling.dithered(points, 0.05, lambda x: np.ones(len(x), bool), 2000, np.random.default_rng(0))
    assert np.max(cKDTree(points).query(drawn, p=np.inf)[0]) <= 0.1


def test_dithering_gives_up_on_an_empty_band() -> None:
    with pytest.raises(UserError, match="too rarely"):
        sampling.dithered(on_sphere(10), 0.05, lambda x: np.zeros(len(x), bool), 10, np.random.default_rng(0))
