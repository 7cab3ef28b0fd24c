"""The demo shape: exact distances and normals, uniform samples, unit sphere."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from mplicits.trainer.shapes.demo import DemoShape, _rope
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, SurfacePoints

SHAPE = DemoShape()


@pytest.fixture(scope="module")
def surface() -> SurfacePoints:
    return SHAPE.surface(400_000, np.random.default_rng(0), colors=True)


def slopes(points: Doubles, step: float = 1e-5) -> Doubles:
    """Compute the gradient of the distance by central differences."""
    axes = step * np.eye(3)
    return np.stack([SHAPE.distance(points + a) - SHAPE.distance(points - a) for a in axes], axis=1) / (2 * step)


@pytest.mark.slow
def test_surface_points_are_at_distance_zero(surface: SurfacePoints) -> None:
    # Also shows that the parts are disjoint: a point inside another part would have a negative distance.
    assert np.abs(SHAPE.distance(surface.points[::20])).max() < 1e-9


def test_distances_match_a_dense_sample_of_the_surface(surface: SurfacePoints) -> None:
    points = np.random.default_rng(1).uniform(-1, 1, (4000, 3))
    inner = surface.points[:4000] - np.random.default_rng(2).uniform(0, 0.07, (4000, 1)) * surface.normals[:4000]
    distance = SHAPE.distance(np.concatenate((points, inner)))
    nearest = cKDTree(surface.points).query(np.concatenate((points, inner)))[0]
    gap = nearest - np.abs(distance)
    assert gap.min() > -1e-9
    # The sample's own spacing h is about 0.004: the nearest sample is off by h^2 / 2d, and by h near the surface.
    assert gap[nearest > 0.02].max() < 1e-3
    assert (distance[4000:] < 1e-9).all()


def test_the_normals_are_the_gradient(surface: SurfacePoints) -> None:
    gradient = slopes(surface.points[:3000] + 1e-3 * surface.normals[:3000])
    assert np.median(np.abs(gradient - surface.normals[:3000])) < 1e-6
    assert (
        np.einsum("ij,ij->i", gradient, surface.normals[:3000]) > 0.999
    ).mean() > 0.99  # less where parts nearly touch


def test_the_shape_fits_the_unit_sphere(surface: SurfacePoints) -> None:
    assert 0.998 < np.linalg.norm(surface.points, axis=1).max() <= 1 + 1e-9
    middle = (surface.points.min(axis=0) + surface.points.max(axis=0)) / 2
    assert np.abs(middle).max() < 2e-3


def test_samples_are_uniform_by_area(surface: SurfacePoints) -> None:
    """By the divergence theorem, the mean normal of a uniform sample is 0 and the mean <x, n> is 3 volume / area."""
    tubes, beads, radius = _rope().tubes, _rope().beads, _rope().radius
    length = sum(np.linalg.norm(np.diff(tube.tree.data, axis=0), axis=1).sum() for tube in tubes)
    bead = _rope().bead_radius
    volume = np.pi * radius**2 * length + 4 / 3 * np.pi * bead**3 * beads.n
    area = 2 * np.pi * radius * length + 4 * np.pi * bead**2 * beads.n
    assert np.abs(surface.normals.mean(axis=0)).max() < 0.004  # 4 sigma
    assert np.einsum("ij,ij->i", surface.points, surface.normals).mean() == pytest.approx(3 * volume / area, abs=0.003)


def test_colors_are_srgb_and_many(surface: SurfacePoints) -> None:
    assert surface.colors is not None
    assert surface.colors.min() >= 0
    assert surface.colors.max() <= 1
    assert len(np.unique((surface.colors[:20_000] * 8).astype(int), axis=0)) > 10


def test_the_name_demo_loads_the_shape() -> None:
    shape, warnings = load_shape("demo")
    assert shape.name == "demo"
    assert not warnings
    assert shape.colored
