"""Thin places: walls, slits and edges of a mesh that a residual has the wrong way round."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from mplicits.model.errors import UserError
from mplicits.trainer import pools
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, Shape
from mplicits.trainer.thin import AROUND_LEAST, LEAST_DISTANCE, MARGIN, ThinPlaces
from support.ball_training import load_ball

COUNT = 20_000
HALF = 0.002
"""Half the thickness of the wall."""
DELTA = 0.05


def load_wall(folder: Path) -> Shape:
    """Write a square wall, `2 HALF` thick in model space, to a file in `folder`, and load it as a shape."""
    trimesh.creation.box((2**0.5, 2**0.5, 2 * HALF)).export(folder / "wall.ply")
    return load_shape(str(folder / "wall.ply"))[0]


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    return load_wall(tmp_path_factory.mktemp("wall"))


def constant(number: float) -> Callable[[Doubles], Doubles]:
    return lambda points: np.full(len(points), number)


def looked(shape: Shape, field: Callable[[Doubles], Doubles]) -> ThinPlaces:
    places = ThinPlaces(shape, np.random.default_rng(0))
    places.look(field, COUNT)
    return places


def test_a_wall_that_is_lost_is_to_be_inside_by_the_margin(wall: Shape) -> None:
    field = constant(1e-3)
    places = looked(wall, field)
    known = places.known
    np.testing.assert_allclose(known[:, 3], wall.distance(known[:, :3].astype(np.float64)), atol=1e-6)
    assert -HALF <= known[:, 3].min() < known[:, 3].max() < -LEAST_DISTANCE
    points, aim = places.hard(field)
    inside = np.abs(points[:, 2]) < HALF
    assert inside.sum() >= len(known) > COUNT / 10
    assert np.isin(-MARGIN, aim)
    np.testing.assert_array_equal(aim[: len(known)], -MARGIN)


def test_around_it_the_distances_are_those_of_the_shape(wall: Shape) -> None:
    """An edge that is drawn out: the field of a wall that has no end."""

    def field(points: Doubles) -> Doubles:
        return np.abs(points[:, 2]) - 2 * MARGIN

    places = looked(wall, constant(1e-3))
    points, aim = places.hard(field)
    assert len(points) > 100, "all of them beside the wall"
    np.testing.assert_allclose(aim, wall.distance(points))
    assert aim.min() > AROUND_LEAST


def test_places_of_the_wrong_sign_are_lost(wall: Shape) -> None:
    places = looked(wall, constant(1e-3))
    points, aim = places.lost(constant(1e-3))
    np.testing.assert_array_equal(points, places.known[:, :3])
    np.testing.assert_array_equal(aim, -MARGIN)
    kept, _ = places.lost(constant(-1e-5))
    assert not len(kept), "however small it is"


def test_a_field_that_keeps_the_margin_has_none(wall: Shape) -> None:
    def field(points: Doubles) -> Doubles:
        distance = wall.distance(points)
        return np.copysign(np.maximum(np.abs(distance), MARGIN), distance)

    assert not len(looked(wall, field).known)
    points, _ = looked(wall, constant(1e-3)).hard(field)
    assert not len(points)


@pytest.mark.parametrize("number", [1e-3, -1e-3, 1.0])
def test_a_ball_has_none_whatever_the_field_is(tmp_path: Path, number: float) -> None:
    places = looked(load_ball(tmp_path), constant(number))
    points, aim = places.hard(constant(number))
    assert len(places.known) == len(points) == len(aim) == 0


@pytest.mark.parametrize(("opening", "thin"), [(40, True), (150, False)])
def test_the_bottom_of_a_notch_is_thin_where_its_sides_face_each_other(
    tmp_path: Path, opening: float, thin: bool
) -> None:
    """opening: the angle between its sides, degrees."""
    half = np.deg2rad(opening / 2)
    rim = np.array([np.sin(half), np.cos(half)])
    outline = np.array([(0, 0), rim, (1.5, rim[1]), (1.5, -0.5), (0, -0.5)])
    ends = [np.column_stack((outline, np.full(len(outline), z))) for z in (0, 1)]
    right, left = (trimesh.convex.convex_hull(np.concatenate(ends) * (side, 1, 1)) for side in (1, -1))
    (right + left).export(tmp_path / "notch.ply")
    places = ThinPlaces(load_shape(str(tmp_path / "notch.ply"))[0], np.random.default_rng(0))
    places.look(constant(-1e-3), 5 * COUNT)
    assert (len(places.known) > 5) == thin


def test_a_slit_is_thin_outside(tmp_path: Path) -> None:
    halves = [trimesh.creation.box((1.0, 1.0, 0.5)) for _ in range(2)]
    for half, side in zip(halves, (1, -1), strict=True):
        half.apply_translation((0, 0, side * (0.25 + HALF)))
    (halves[0] + halves[1]).export(tmp_path / "slit.ply")
    slit = load_shape(str(tmp_path / "slit.ply"))[0]
    known = looked(slit, constant(-1e-3)).known
    assert len(known) > COUNT / 100
    assert known[:, 3].min() > LEAST_DISTANCE
    assert np.abs(known[:, 2]).max() < HALF


def test_a_level_that_is_gone_on_with_holds_the_same_places(wall: Shape) -> None:
    flat = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.full((1,), 1e-3)]

    def sampler(seed: int) -> pools.Sampler:
        return pools.Sampler(wall, [flat], [DELTA], torch.device("cpu"), np.random.default_rng(seed))

    first = sampler(0)
    known = first.hard(flat, None, 2000, 0.0)
    snapshot = first.snapshot()
    expected = first.hard(flat, known, 2000, 0.0)
    again = sampler(1)
    again.restore(snapshot)
    found = again.hard(flat, known, 2000, 0.0)
    assert expected is not None
    assert found is not None
    torch.testing.assert_close(found.points, expected.points, rtol=0, atol=0)
    wrong = sampler(2)
    snapshot.tensors["thin"] = torch.zeros(5, 3)
    with pytest.raises(UserError, match="thin"):
        wrong.restore(snapshot)
