"""Hard-example mining: where a level is badly wrong off the surface, in thin features, and at strays."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from mplicits.model.errors import UserError
from mplicits.trainer.config import SamplingConfig
from mplicits.trainer.frozen_levels import FrozenLevels
from mplicits.trainer.mining import HardExamples, Miner, ThinFeatures
from mplicits.trainer.mining_config import MiningConfig, ThinConfig
from mplicits.trainer.networks.network import Weights
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, Shape
from mplicits.trainer.training_samples import Sampler
from support.ball_training import CPU, SMALL_SETTINGS, constant, frozen_level, rng, train

MINING, SAMPLING, THIN = MiningConfig(), SamplingConfig(), ThinConfig()
DELTA, NEAR = 0.05, 0.008
COUNT = 20_000
HALF = 0.002
"""Half the thickness of the wall."""


def mine(shape: Shape, f1: float, residual: float, count: int = 2000, earlier: Doubles | None = None) -> HardExamples:
    found = Miner(shape, frozen_level(DELTA, f1), rng()).mine(constant(residual), earlier, count, NEAR)
    assert found is not None
    return found


def test_points_off_the_surface_where_the_field_vanishes_are_hard(ball: Shape) -> None:
    found = mine(ball, 0.0, 0.0)
    away = np.linalg.norm(found.points, axis=1) - 1
    assert np.abs(away).min() > MINING.least_distance * DELTA - 5e-3
    reach = SAMPLING.largest_distance * DELTA
    np.testing.assert_allclose(found.distance, away.clip(-reach, reach), atol=5e-3)
    again = mine(ball, 0.0, 0.0, earlier=found.points)
    assert len(again.points) > len(found.points), "there are candidates around earlier ones, too"


@pytest.mark.parametrize(("f1", "residual"), [(0.04, 0.0), (0.04, -0.02), (2 * DELTA, 0.0)])
def test_a_residual_that_neither_vanishes_nor_exceeds_has_no_hard_points(
    ball: Shape, f1: float, residual: float
) -> None:
    """The last case has no band at all."""
    assert Miner(ball, frozen_level(DELTA, f1), rng()).mine(constant(residual), None, 2000, NEAR) is None


def test_points_where_a_residual_exceeds_the_distance_are_hard(ball: Shape) -> None:
    """Where f = 0.04 and f_1 = 0: between NEAR and 0.04 / excess from the surface."""
    distance = mine(ball, 0.0, 0.04, COUNT).distance
    outside = distance[(distance > 0) & (distance < DELTA)]  # Farther away, f is too small.
    assert NEAR <= outside.min() < NEAR + 2e-3
    assert 0.04 / MINING.excess - 2e-3 < outside.max() < 0.04 / MINING.excess


def test_wrong_signs_are_hard_close_to_a_mesh_but_not_close_to_a_cloud(
    ball: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    nearest = []
    for cloud in (False, True):
        monkeypatch.setattr(ball, "cloud", cloud)
        distance = mine(ball, 0.0, -1e-4, COUNT).distance
        nearest.append(distance[distance > 0].min())
        assert distance[distance < 0].max() < -MINING.least_distance * DELTA
    assert MINING.wrong_sign < nearest[0] < MINING.wrong_sign + 1e-3
    assert nearest[1] > MINING.least_distance * DELTA


def test_excess_is_not_hard_for_a_noisy_cloud(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ball, "noise", 0.01)
    assert Miner(ball, frozen_level(DELTA), rng()).mine(constant(0.04), None, COUNT, NEAR) is None


def test_points_where_level_1_exceeds_the_distance_are_hard(ball: Shape) -> None:
    """Where f = 0.03: between NEAR and 0.03 / excess from the surface."""
    first = Miner(ball, FrozenLevels([], [], CPU), rng())
    found = first.mine(constant(0.03), None, 10_000, NEAR)
    assert found is not None
    away = np.linalg.norm(found.points, axis=1) - 1
    assert NEAR - 5e-3 < np.abs(away).min() < NEAR + 5e-3
    assert 0.025 < np.abs(away).max() < 0.03 / MINING.excess + 5e-3
    np.testing.assert_allclose(found.distance, away, atol=5e-3)
    again = first.mine(constant(0.03), found.points, 10_000, NEAR)
    assert again is not None
    assert len(again.points) > len(found.points)
    assert first.mine(constant(0.0), None, 10_000, NEAR) is None, "a field that is too small has none"


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("weights", "levels"), [({}, {0, 1}), ({"excess": 1.0}, {1})])
def test_level_1_is_mined_where_excess_has_a_larger_weight(
    ball: Shape, monkeypatch: pytest.MonkeyPatch, weights: dict[str, float], levels: set[int]
) -> None:
    mined = set()
    original = Miner.mine

    def counted(self: Miner, *arguments: object) -> HardExamples | None:
        mined.add(len(self._frozen.levels))
        return original(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Miner, "mine", counted)
    train(ball, replace(SMALL_SETTINGS, weights=weights))
    assert mined == levels


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    """A square wall, `2 HALF` thick in model space."""
    path = tmp_path_factory.mktemp("wall") / "wall.ply"
    trimesh.creation.box((2**0.5, 2**0.5, 2 * HALF)).export(path)
    return load_shape(str(path))[0]


def everywhere(number: float) -> Callable[[Doubles], Doubles]:
    return lambda points: np.full(len(points), number)


def searched(shape: Shape, field: Callable[[Doubles], Doubles], count: int = COUNT) -> ThinFeatures:
    features = ThinFeatures(shape, rng())
    features.search(field, count)
    return features


def test_a_lost_wall_is_taught_to_be_inside_by_the_margin(wall: Shape) -> None:
    field = everywhere(1e-3)
    features = searched(wall, field)
    known = features.known
    np.testing.assert_allclose(known[:, 3], wall.distance(known[:, :3].astype(np.float64)), atol=1e-6)
    assert -HALF <= known[:, 3].min() < known[:, 3].max() < -THIN.least_distance
    points, taught = features.mine(field, 0)
    inside = np.abs(points[:, 2]) < HALF
    assert inside.sum() >= len(known) > COUNT / 10
    np.testing.assert_array_equal(taught[: len(known)], -THIN.margin)


def test_around_thin_features_the_distances_are_the_shapes(wall: Shape) -> None:
    """The field of a wall without an end extends the edge."""
    points, taught = searched(wall, everywhere(1e-3)).mine(lambda at: np.abs(at[:, 2]) - 2 * THIN.margin, 0)
    assert len(points) > 100, "all of them beside the wall"
    np.testing.assert_allclose(taught, wall.distance(points))
    assert taught.min() > THIN.around_least_distance


def test_a_field_with_the_margin_has_no_thin_features(wall: Shape) -> None:
    def field(points: Doubles) -> Doubles:
        distance = wall.distance(points)
        return np.copysign(np.maximum(np.abs(distance), THIN.margin), distance)

    assert not len(searched(wall, field).known)
    assert not len(searched(wall, everywhere(1e-3)).mine(field, 0)[0])


@pytest.mark.parametrize("number", [1e-3, -1e-3, 1.0])
def test_a_ball_has_no_thin_features(ball: Shape, number: float) -> None:
    features = searched(ball, everywhere(number))
    points, taught = features.mine(everywhere(number), 0)
    assert len(features.known) == len(points) == len(taught) == 0


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
    features = searched(load_shape(str(tmp_path / "notch.ply"))[0], everywhere(-1e-3), 5 * COUNT)
    assert (len(features.known) > 5) == thin


def test_a_slit_is_thin_outside(tmp_path: Path) -> None:
    halves = [trimesh.creation.box((1.0, 1.0, 0.5)) for _ in range(2)]
    for half, side in zip(halves, (1, -1), strict=True):
        half.apply_translation((0, 0, side * (0.25 + HALF)))
    (halves[0] + halves[1]).export(tmp_path / "slit.ply")
    known = searched(load_shape(str(tmp_path / "slit.ply"))[0], everywhere(-1e-3)).known
    assert len(known) > COUNT / 100
    assert known[:, 3].min() > THIN.least_distance
    assert np.abs(known[:, 2]).max() < HALF


def test_a_resumed_miner_finds_the_same_examples(wall: Shape) -> None:
    flat: Weights = constant(1e-3)

    def miner(seed: int) -> tuple[Miner, Sampler]:
        generator, frozen = rng(seed), FrozenLevels([flat], [DELTA], CPU)
        return Miner(wall, frozen, generator), Sampler(wall, frozen, generator)

    first, sampler = miner(0)
    earlier = first.mine(flat, None, 2000, 0.0)
    assert earlier is not None
    snapshot = first.snapshot() | sampler.snapshot()
    expected = first.mine(flat, earlier.points, 2000, 0.0)
    again, sampler = miner(1)
    again.restore(snapshot)
    sampler.restore(snapshot)
    found = again.mine(flat, earlier.points, 2000, 0.0)
    assert expected is not None
    assert found is not None
    np.testing.assert_array_equal(found.points, expected.points)
    snapshot.tensors["thin"] = torch.zeros(5, 3)
    with pytest.raises(UserError, match="thin"):
        again.restore(snapshot)


def test_samples_around_loose_components_have_the_shapes_distances(ball: Shape) -> None:
    miner, vertices = Miner(ball, frozen_level(DELTA), rng()), np.array([[1.1, 0.0, 0.0]])
    found = miner.mine(constant(0.0), None, 2000, NEAR)
    more = miner.around(found, vertices)
    assert found is not None
    added = more.points[len(found.points) :]
    assert len(added) == round(MINING.component_ratio * len(found.points))
    assert np.linalg.norm(added - vertices, axis=1).max() < 6 * MINING.component_spread
    np.testing.assert_allclose(more.distance[len(found.points) :], np.linalg.norm(added, axis=1) - 1, atol=5e-3)
    assert more.ratio == pytest.approx(len(more.points) / len(found.points), rel=1e-3)
    assert len(miner.around(None, vertices).points) == round(MINING.component_ratio * MINING.fewest)


def test_strays_far_from_the_surface_are_sampled_with_a_bounded_distance(ball: Shape) -> None:
    delta = 0.02
    pool = Sampler(ball, frozen_level(delta), rng()).volume(4000)
    assert pool.distance is not None
    radii = pool.points.norm(dim=1)
    far = (radii - 1).abs() > 4 * delta
    assert 0.06 < far.double().mean() < 0.2, "where f = 0, the band is everywhere"
    assert float(pool.distance.abs().max()) <= SAMPLING.largest_distance * delta * 1.0001
    assert (pool.distance[far].sign() == (radii[far] - 1).sign()).all()


def test_level_1_sees_the_ball_and_a_few_points_of_the_corners(ball: Shape) -> None:
    radii = Sampler(ball, FrozenLevels([], [], CPU), rng()).volume(10_000).points.norm(dim=1)
    corners = (radii > 1 + np.sqrt(3) * SAMPLING.first_band).double().mean()
    assert 0.02 < corners < SAMPLING.corner_share + 0.01
    assert float((radii < 0.5).double().mean()) > 0.5**3 * 0.5, "the inside, too, by its volume"
