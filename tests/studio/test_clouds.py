"""The studio's clouds in Chromium, against the Python trainer's."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh

from mplicits.trainer.shapes.cloud import CloudShape
from mplicits.trainer.shapes.shape import SurfacePoints
from support.page_scripts import WORKER, scope

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

MEASURE = """([points, normals, places]) => {
    const shape = new CloudShape(Float64Array.from(points), Float64Array.from(normals));
    return Array.from({length: places.length / 3}, (_, i) => shape.distance(...places.slice(3 * i, 3 * i + 3)))
        .map((distance) => (Number.isNaN(distance) ? null : distance));
}"""
DRAW = """([points, count]) => {
    const array = Float64Array.from(points), colors = {vertex: Float32Array.from(points, Math.abs)};
    const shape = new CloudShape(array, array, colors);
    const drawn = new Float32Array(3 * count), rows = shape.surface(count, randomNumbers(1), drawn);
    return [[...rows], [...drawn], [...shape.corners(1, 3)]];
}"""
DRAW_MESH = """([vertices, faces, count]) => {
    const vertex = Float32Array.from(vertices, Math.abs);
    const shape = new Shape(Float64Array.from(vertices), Uint32Array.from(faces), {vertex, uv: null, materials: []});
    const colors = new Float32Array(3 * count), rows = shape.surface(count, randomNumbers(1), colors);
    return [[...rows], [...colors], [...shape.surface(count, randomNumbers(1))]];
}"""


@pytest.fixture(scope="module")
def page(browser: "Browser") -> Iterator["Page"]:
    with scope(browser, WORKER, "Object.assign(window, {CloudShape, Shape, randomNumbers});") as page:
        yield page


def cloud(mesh: trimesh.Trimesh, count: int) -> SurfacePoints:
    points, face = trimesh.sample.sample_surface(mesh, count, seed=1)
    return SurfacePoints(np.asarray(points), np.asarray(mesh.face_normals[face]))


@pytest.mark.parametrize("hole", [False, True], ids=["closed", "open"])
def test_distances_are_python_s(hole: bool, page: "Page") -> None:
    mesh = trimesh.creation.torus(0.7, 0.25, 200, 100)
    sampled = cloud(mesh, 4000)
    if hole:
        sampled = sampled.take(sampled.points[:, 0] < 0.4)
    theirs = CloudShape(sampled, "torus", {}, noise=0.0)
    points, normals = theirs._training.points, theirs._training.normals
    random = np.random.default_rng(2)
    places = random.uniform(-1.1, 1.1, (2000, 3))
    places[:1000] = points[random.integers(len(points), size=1000)] + random.normal(scale=0.03, size=(1000, 3))
    ours = page.evaluate(MEASURE, [points.ravel().tolist(), normals.ravel().tolist(), places.ravel().tolist()])
    distance, expected = np.array(ours, dtype=float), theirs.distance(places)
    assert np.isnan(expected).mean() > (0.02 if hole else 0)
    # Python adds up the winding number over other groups of points, which moves the border of what is known.
    assert (np.isnan(distance) == np.isnan(expected)).mean() > 0.995
    both = ~np.isnan(distance) & ~np.isnan(expected)
    assert both.mean() > 0.8
    np.testing.assert_allclose(distance[both], expected[both], atol=1e-9)


def test_each_point_of_a_cloud_is_drawn_equally_often(page: "Page") -> None:
    points = np.asarray(trimesh.creation.icosphere(2).vertices, np.float32)
    rows, colors, corners = (np.array(part) for part in page.evaluate(DRAW, [points.ravel().tolist(), 3 * 162]))
    rows = rows.reshape(-1, 12)
    drawn, times = np.unique(rows[:, :3], axis=0, return_counts=True)
    assert (len(drawn), set(times)) == (162, {3})
    assert not (rows[:162, :3] == points).all()
    np.testing.assert_array_equal(rows[:, 9:], rows[:, :3])
    np.testing.assert_array_equal(rows[:, 3:9], 0)
    np.testing.assert_array_equal(colors.reshape(-1, 3), np.abs(rows[:, :3]))
    np.testing.assert_array_equal(corners.reshape(-1, 12)[:, :3], points[1::3])


def test_points_of_a_mesh_have_their_colors(page: "Page") -> None:
    mesh = trimesh.creation.box()
    mesh.vertices += 1  # no color is negative
    arguments: list[Any] = [np.asarray(mesh.vertices).ravel().tolist(), np.asarray(mesh.faces).ravel().tolist(), 500]
    rows, colors, plain = (np.array(part) for part in page.evaluate(DRAW_MESH, arguments))
    np.testing.assert_array_equal(rows, plain)
    np.testing.assert_allclose(colors.reshape(-1, 3), rows.reshape(-1, 12)[:, :3], atol=1e-6)
