"""Each part of a mesh or a cloud is made consistent and turned outward by itself; cavities and open sheets stay."""

from typing import Any

import numpy as np
import pytest
import trimesh

from mplicits.model.errors import UserError
from mplicits.readers.clouds import mesh_of_arrays
from mplicits.trainer.shapes.cloud_facing import turned_outward
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.parts import facing, facing_warnings
from mplicits.trainer.shapes.shape import Doubles, unit


def ball(radius: float, x: float = 0.0, inward: bool = False) -> trimesh.Trimesh:
    mesh: trimesh.Trimesh = trimesh.creation.icosphere(3, radius)
    mesh.apply_translation((x, 0, 0))
    if inward:
        mesh.invert()
    return mesh


def together(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    joined: Any = trimesh.util.concatenate(list(meshes))
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def distances(mesh: trimesh.Trimesh, *places: tuple[float, float, float]) -> tuple[list[float], list[str]]:
    """Distances at places in the mesh's coordinates, and the warnings."""
    shape, warnings = load_shape((np.asarray(mesh.vertices), np.asarray(mesh.faces)), crease=None)
    found = shape.distance((np.array(places) - shape.center) / shape.scale) * shape.scale
    return np.round(found, 1).tolist(), [line.removeprefix("arrays: ") for line in warnings]


@pytest.mark.parametrize("inward", [(False, True), (True, False), (True, True), (False, False)])
def test_each_part_is_turned_by_itself(inward: tuple[bool, bool]) -> None:
    found, warnings = distances(together(ball(1, -2, inward[0]), ball(0.5, 2, inward[1])), (-2, 0, 0), (2, 0, 0))
    assert found == [-1.0, -0.5]
    count = sum(inward)
    assert (
        warnings
        == {
            0: [],
            1: ["1 of 2 parts point inwards; reversed"],
            2: ["the faces point inwards; reversed"],
        }[count]
    )


@pytest.mark.parametrize("turned", [False, True])
def test_a_cavity_stays_a_cavity(turned: bool) -> None:
    mesh = together(ball(1), ball(0.5, inward=True))
    if turned:
        mesh.invert()
    found, warnings = distances(mesh, (0, 0, 0), (0.7, 0, 0), (2, 0, 0))
    assert found == [0.5, -0.2, 1.0]
    assert warnings == (["the faces point inwards; reversed"] if turned else [])


def test_a_part_inside_another_is_solid() -> None:
    assert distances(together(ball(1), ball(0.5)), (0, 0, 0))[0][0] < 0


@pytest.mark.parametrize("share", [0.1, 0.3, 0.8])
def test_faces_of_a_part_are_made_consistent(share: float) -> None:
    mesh = ball(1)
    faces = np.array(mesh.faces)
    flipped = np.random.default_rng(0).random(len(faces)) < share
    faces[flipped] = faces[flipped, ::-1]
    found, warnings = distances(trimesh.Trimesh(mesh.vertices, faces, process=False), (0, 0, 0), (0.9, 0, 0))
    assert found == [-1.0, -0.1]
    one, other = mesh.face_adjacency.T
    disagreeing = float(np.mean(flipped[one] != flipped[other]))
    assert f"{disagreeing:.2%} of the edges join faces of opposite sides; made consistent" in warnings


def test_a_part_with_a_hole_is_turned() -> None:
    mesh = ball(1, inward=True)
    mesh.update_faces(mesh.triangles_center[:, 2] < 0.7)
    found, warnings = distances(mesh, (0, 0, -0.5))
    assert found == [-0.5]
    assert warnings[0] == "the faces point inwards; reversed"


def sheet(height: Doubles) -> trimesh.Trimesh:
    """Heights (N, N) over a square, as triangles that face up."""
    n = len(height)
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])
    return trimesh.Trimesh(np.stack([x, y, height], axis=-1).reshape(-1, 3), faces, process=False)


@pytest.mark.parametrize("height", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("down", [False, True])
def test_open_sheets_are_not_turned_and_refused(height: float, down: bool) -> None:
    at = np.linspace(-1, 1, 30)
    mesh = sheet(height * np.sin(4 * at)[:, None] * np.cos(3 * at))
    if down:
        mesh.invert()
    found = facing(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64))
    assert not found.flipped.any()
    assert facing_warnings(found) == []
    with pytest.raises(UserError, match="--thicken T"):
        distances(mesh, (0, 0, 0))


def test_half_a_ball_is_no_sheet() -> None:
    mesh = ball(1)
    mesh.update_faces(mesh.triangles_center[:, 2] < 0)
    assert distances(mesh, (0, 0, -0.5))[0] == [-0.5]


def test_a_small_main_part_is_said_once() -> None:
    mesh = together(ball(1), ball(0.01, 60))
    warnings = distances(mesh, (0, 0, 0))[1]
    assert len(warnings) == 1
    assert warnings[0].startswith("2 parts, and the main one has 1/31 of the whole radius")
    assert distances(together(ball(1), ball(0.5, 3)), (0, 0, 0))[1] == []


def test_a_non_orientable_surface_is_read() -> None:
    around, across = np.linspace(0, 2 * np.pi, 60, endpoint=False), np.linspace(-0.4, 0.4, 8)
    u, v = np.meshgrid(around, across, indexing="ij")
    radius = 1 + v * np.cos(u / 2)
    points = np.stack((radius * np.cos(u), radius * np.sin(u), v * np.sin(u / 2)), axis=-1).reshape(-1, 3)
    at = np.arange(480).reshape(60, 8)
    at = np.concatenate((at, at[:1, ::-1]))  # the last column meets the first one upside down
    corners = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    rows = np.stack(corners, axis=-1).reshape(-1, 4)
    faces = np.array([(a, b, c) for a, b, c, _ in rows] + [(a, c, d) for a, _, c, d in rows])
    found = facing(points, faces)
    assert 0 < found.disagreeing < 0.1
    mesh = mesh_of_arrays(points, faces, None, None)
    assert load_shape((mesh.vertices, mesh.faces), thicken=0.05)[0].distance(np.zeros((1, 3)))[0] > 0


def on_ball(count: int, center: tuple[float, float, float] = (0, 0, 0), radius: float = 1.0) -> tuple[Doubles, Doubles]:
    normals = unit(np.random.default_rng(0).normal(size=(count, 3)))
    return radius * normals + center, normals


def test_clouds_are_turned_part_by_part() -> None:
    (first, one), (second, two) = on_ball(3000, (-2, 0, 0)), on_ball(1500, (2, 0, 0), 0.7)
    for signs, turned in (((1, 1), 0), ((-1, 1), 1), ((1, -1), 1), ((-1, -1), 2)):
        normals, count, parts = turned_outward(
            np.concatenate((first, second)), np.concatenate((signs[0] * one, signs[1] * two))
        )
        assert (count, parts) == (turned, 2)
        np.testing.assert_allclose(normals, np.concatenate((one, two)))


def test_cavities_and_views_from_one_side_of_clouds_stay() -> None:
    (outer, one), (inner, two) = on_ball(4000), on_ball(2000, radius=0.5)
    normals, count, _ = turned_outward(np.concatenate((outer, inner)), np.concatenate((one, -two)))
    assert count == 0
    np.testing.assert_allclose(normals, np.concatenate((one, -two)))
    front = outer[:, 2] > 0.3
    for sign in (1, -1):
        assert turned_outward(outer[front], sign * one[front])[1] == 0


def test_boxes_that_touch_at_an_edge_are_turned_one_by_one() -> None:
    one, other = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1))
    other.apply_translation((1, 1, 0))
    for signs, turned in (((1, 1), 0), ((1, -1), 1), ((-1, -1), 2)):
        faces = [box.faces[:, ::sign] for box, sign in zip((one, other), signs, strict=True)]
        mesh = trimesh.Trimesh(np.concatenate((one.vertices, other.vertices)), np.concatenate((faces[0], faces[1] + 8)))
        shape, _ = load_shape((np.asarray(mesh.vertices), np.asarray(mesh.faces)))
        assert shape.taken is not None
        assert (shape.taken.parts, shape.taken.turned) == (2, turned)
        places = (np.array([(0, 0, 0), (1, 1, 0), (1, 0, 0)]) - shape.center) / shape.scale
        assert (shape.distance(places) < 0).tolist() == [True, True, False]
