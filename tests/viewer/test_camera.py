"""The orbit camera: axes, default distance, errors, and moves."""

import math

import numpy as np
import pytest

from mplicits.model.errors import UserError
from mplicits.viewer.draw.camera import Camera


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (30, 20), (-170, -65), (90, 90), (400, -90)])
def test_the_axes_are_orthonormal_and_look_at_the_target(azimuth: float, elevation: float) -> None:
    camera = Camera(azimuth, elevation, 3.0, target=(0.1, -0.2, 0.3))
    right, up, back, eye = camera.matrix()[:3].T
    np.testing.assert_allclose(np.array([right, up, back]) @ np.array([right, up, back]).T, np.eye(3), atol=1e-6)
    np.testing.assert_allclose(np.cross(right, up), back, atol=1e-6)
    np.testing.assert_allclose(eye - 3.0 * back, (0.1, -0.2, 0.3), atol=1e-6)
    np.testing.assert_array_equal(camera.matrix()[3], (0, 0, 0, 1))
    assert camera.matrix().dtype == np.float32


def test_azimuth_and_elevation_start_at_z_and_turn_to_x_and_y() -> None:
    np.testing.assert_allclose(Camera(0, 0, 2).matrix()[:3, 3], (0, 0, 2), atol=1e-6)
    np.testing.assert_allclose(Camera(90, 0, 2).matrix()[:3, 3], (2, 0, 0), atol=1e-6)
    np.testing.assert_allclose(Camera(0, 90, 2).matrix()[:3, 3], (0, 2, 0), atol=1e-6)


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("fov", [10.0, 35.0, 90.0])
def test_the_unit_sphere_fits_into_the_picture_by_default(fov: float, aspect: float) -> None:
    camera = Camera(fov=fov, aspect=aspect)
    silhouette = math.tan(math.asin(1.0 / camera.away)) * camera.focal
    assert 0.85 < silhouette / min(1.0, aspect) < 1.0


@pytest.mark.parametrize(
    ("name", "numbers"),
    [("distance", (0.0, -1.0, 1e9)), ("azimuth", (math.nan,)), ("elevation", (math.inf,)), ("fov", (0.0, 180.0))],
)
def test_numbers_out_of_range_are_errors(name: str, numbers: tuple[float, ...]) -> None:
    for number in numbers:
        with pytest.raises(UserError):
            Camera(**{name: number})  # type: ignore[arg-type]


def test_moves_turn_zoom_and_pan_within_their_bounds() -> None:
    camera = Camera(10, 80, 3.0)
    assert camera.orbited(-30, 50).elevation == 90.0
    assert camera.orbited(-30, 50).azimuth == 340.0
    assert camera.zoomed(2.0).away == 6.0
    assert camera.zoomed(1e-9).away > 0
    moved = camera.panned(0.5, -0.25)
    displacement = moved.matrix()[:3, 3] - camera.matrix()[:3, 3]
    np.testing.assert_allclose(camera.matrix()[:3, :3].T @ displacement, (0.5, -0.25, 0), atol=1e-6)
