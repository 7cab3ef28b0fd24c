"""Clouds of depth maps of known shapes, and their invented back sides."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mplicits.capture.backside import rim
from mplicits.capture.cloud import Cloud
from mplicits.capture.depth_map import from_inverse
from mplicits.capture.intrinsics import Intrinsics, of_view
from mplicits.capture.planes import fit_planes
from mplicits.capture.unproject import step_share, unproject
from mplicits.model.errors import UserError

Doubles = NDArray[np.float64]

SIDE = 128
CENTER = np.array([0.3, -0.2, -4.0])
"""Center of a ball of radius 1, in a cloud's axes."""
CAMERA = of_view(40, SIDE, SIDE)


def ball(camera: Intrinsics = CAMERA, side: int = SIDE) -> Doubles:
    """Return the ball's depths along the axis, NaN beside it."""
    x, y = camera.plane(side, side)
    rays = np.stack(np.broadcast_arrays(x, -y[:, None], -1.0), axis=-1)
    along, square = rays @ CENTER, (rays**2).sum(-1)
    root = along**2 - square * (CENTER @ CENTER - 1)
    with np.errstate(invalid="ignore"):
        return np.asarray((along - np.sqrt(root)) / square)


def errors(cloud: Cloud) -> tuple[Doubles, Doubles]:
    """Return the points' distances from the ball, and the errors of their normals, degrees."""
    away = cloud.points - CENTER
    cosine = (away / np.linalg.norm(away, axis=1, keepdims=True) * cloud.normals).sum(1)
    return np.abs(np.linalg.norm(away, axis=1) - 1), np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def quantized(depth: Doubles) -> Doubles:
    """Round depths to 254 steps."""
    near, far = np.nanmin(depth), np.nanmax(depth)
    return np.asarray(near + (far - near) * np.round((depth - near) / (far - near) * 254) / 254)


def holed(depth: Doubles) -> Doubles:
    """Remove blocks of pixels."""
    result = depth.copy()
    for y, x in np.random.default_rng(1).integers(10, SIDE - 10, (40, 2)):
        result[y : y + 4, x : x + 4] = np.nan
    return result


def test_points_of_an_exact_map_lie_on_the_shape_with_its_normals() -> None:
    cloud, cut, planes = unproject(ball(), CAMERA, None)
    distance, angle = errors(cloud)
    assert planes.noise < 1e-3
    assert cut.grazing > 0
    assert distance.max() < 4e-3
    assert np.median(distance) < 4e-4
    assert np.percentile(angle, 99) < 8
    assert len(cloud.points) > 0.9 * np.isfinite(ball()).sum()


@pytest.mark.parametrize("worsened", [quantized, holed])
def test_rounded_maps_and_maps_with_holes_are_accurate_to_a_hundredth(worsened: Callable[[Doubles], Doubles]) -> None:
    depth = worsened(ball())
    step = step_share(depth, depth, inverse=False) if worsened is quantized else 0.0
    distance, angle = errors(unproject(depth, CAMERA, None, step)[0])
    assert np.percentile(distance, 99) < 0.01
    assert np.median(angle) < 5


def test_noise_is_measured_and_smoothed() -> None:
    """From noise of 1 % of the ball's diameter, planes through wide windows leave a third, and usable normals."""
    noise = np.random.default_rng(2).normal(0, 0.02, (SIDE, SIDE))
    cloud, _, planes = unproject(ball() + noise, CAMERA, None)
    distance, angle = errors(cloud)
    assert planes.noise == pytest.approx(0.02 / 3.5, rel=0.25)
    assert np.sqrt((distance**2).mean()) < 0.3 * np.sqrt((noise**2).mean())
    assert np.median(angle) < 12


def test_planes_are_exact_under_perspective() -> None:
    x, y = CAMERA.plane(SIDE, SIDE)
    normal = np.array([0.5, -0.3, -0.8]) / np.linalg.norm([0.5, -0.3, -0.8])
    depth = -2.0 / (normal[0] * x + normal[1] * y[:, None] + normal[2])
    planes = fit_planes(depth, x, y)
    np.testing.assert_allclose(planes.depth, depth, rtol=1e-9)
    np.testing.assert_allclose(planes.normals, np.broadcast_to(normal, planes.normals.shape), atol=1e-6)


def test_pixels_between_two_surfaces_are_dropped() -> None:
    """Resized maps have pixels halfway between a near square and a wall."""
    depth = np.full((64, 64), 3.0)
    depth[20:44, 20:44] = 2.0
    for edge in (19, 44):
        depth[19:45, edge] = depth[edge, 19:45] = 2.5
    cloud, cut, _ = unproject(depth, of_view(50, 64, 64), None)
    between = np.abs(-cloud.points[:, 2] - 2.5) < 0.4
    assert not between.any()
    assert cut.grazing + cut.edges + cut.outliers >= 100


def test_colors_and_axes_follow_the_picture() -> None:
    """The right half is red; x points right, y up, and the camera looks along -z."""
    colors = np.zeros((SIDE, SIDE, 3), np.uint8)
    colors[:, SIDE // 2 :, 0] = 255
    cloud = unproject(ball(), CAMERA, colors)[0]
    assert cloud.colors is not None
    right = cloud.points[:, 0] / -cloud.points[:, 2] > 0
    np.testing.assert_array_equal(cloud.colors[:, 0] == 255, right)
    assert abs(cloud.points[:, 1].mean() - CENTER[1]) < 0.05


def test_the_back_side_closes_the_shape() -> None:
    """From nearby, less than half of the ball is visible, so that the closed shape is flatter than the ball."""
    cloud = unproject(ball(), CAMERA, np.full((SIDE, SIDE, 3), 9, np.uint8), close=True)[0]
    seen = len(unproject(ball(), CAMERA, None)[0].points)
    behind, normals = cloud.points[seen:], cloud.normals[seen:]
    joint = abs((normals * behind).sum(axis=1)) < 1e-9
    assert joint.sum() > 100
    assert ((behind[joint] - CENTER) * normals[joint]).sum(axis=1).min() > 0
    behind, normals = behind[~joint], normals[~joint]
    assert len(behind) > 0.9 * seen
    assert np.percentile(np.linalg.norm(behind - CENTER, axis=1), 99) < 1.05
    assert 0.5 < (behind[:, 2] - CENTER[2]).max() - (behind[:, 2] - CENTER[2]).min() < 1.3
    assert ((normals * behind).sum(axis=1) > 0).mean() > 0.99
    closest = np.asarray(cKDTree(behind).query(cloud.points[:seen])[0])
    assert closest.min() < 0.05
    assert cloud.colors is not None
    assert len(cloud.colors) == len(cloud.points)


def test_the_rim_joins_both_sides_with_points_a_pixel_apart() -> None:
    """A disc, two pixels thick at its left end and eight at its right end."""
    x = y = (np.arange(40) - 19.5) / 100
    front = np.where(np.hypot(x, y[:, None]) < 0.15, 2.0, np.nan)
    behind = front + 2 * (0.05 + 0.2 * x)
    points, normals, (rows, columns) = rim(front, behind, ~np.isnan(front), x, y)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    assert np.hypot(x[columns], y[rows]).min() > 0.13
    assert (points[:, 2] > 2).all()
    assert (points[:, 2] < behind[rows, columns]).all()
    outward = np.column_stack((x[columns], y[rows])) / np.hypot(x[columns], y[rows])[:, None]
    assert (outward * normals[:, :2]).sum(axis=1).min() > 0.9
    closest = np.asarray(cKDTree(points).query(points, k=2)[0])[:, 1]
    assert closest.max() < 0.03
    thin, thick = (np.count_nonzero(columns == k) for k in (columns.min(), columns.max()))
    assert thick > 2 * thin
    wider = np.hypot(x, y[:, None]) < 0.17
    moved = rim(front, behind, wider, x, y)[0]
    assert (np.hypot(*(moved[:, :2] / moved[:, 2:]).T) - np.hypot(*(points[:, :2] / points[:, 2:]).T)).min() > 0.01


def test_a_large_map_is_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mplicits.capture.unproject.MOST", 900)
    depth = np.full((SIDE, SIDE), 2.0)
    assert 180 < len(unproject(depth, CAMERA, None)[0].points) <= 900


def test_inverse_depths_of_any_scale_give_the_same_depths() -> None:
    depth = ball()
    near, far = float(np.nanmin(depth)), float(np.nanmax(depth))
    for scale, shift in ((1.0, 0.0), (100.0, 7.0)):
        np.testing.assert_allclose(from_inverse(scale / depth + shift, near, far), depth, rtol=1e-9)
    with pytest.raises(UserError, match="all depths are the same"):
        from_inverse(np.full((9, 9), 2.0), 1, 2)


def test_a_grazing_surface_is_refused() -> None:
    camera = of_view(2, 64, 64)
    x, _ = camera.plane(64, 64)
    tilt = np.radians(86)
    depth = np.tile(2 * np.cos(tilt) / (np.cos(tilt) - np.sin(tilt) * x), (64, 1))
    with pytest.raises(UserError, match="all pixels are depth edges or grazing"):
        unproject(depth, camera, None)


def test_a_map_of_noise_is_refused() -> None:
    noise = np.random.default_rng(3).uniform(0.1, 100, (32, 32))
    with pytest.raises(UserError, match="jump by"):
        unproject(noise, of_view(40, 32, 32), None)
