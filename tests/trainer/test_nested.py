"""The nesting of levels (Eq. 3) in torch against its definition in NumPy, field/interpret.py."""

import numpy as np
import pytest
import torch

from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.model import Array, Model
from mplicits.trainer.networks.nested import field, field_and_gradient, in_band, nested_field, nested_field_and_gradient
from mplicits.trainer.networks.network import Weights, from_model
from support.random_model import random_model

MODELS = (
    random_model((8, 1)),
    random_model((8, 0), (12, 1), seed=1),
    random_model((8, 1), (16, 1), (8, 2), seed=2),
    random_model((6, 0), (8, 1), (8, 1), (12, 2), seed=3),
)
TOLERANCE = 1e-4
"""Of values; also how far |f_i| must be from delta_i so that rounding does not decide on which side it is."""


def levels_and_deltas(model: Model) -> tuple[list[Weights], list[float]]:
    return [from_model(level.network) for level in model.levels], [level.delta for level in model.levels]


def decided_points(model: Model) -> Array:
    """Draw points (N, 3) float32 of the domain at which no |f_i| is as large as delta_i within rounding."""
    points = np.random.default_rng(4).uniform(-1, 1, (20_000, 3)).astype(np.float32)
    program, decided = lower(model), np.ones(len(points), np.bool_)
    for i, level in enumerate(model.levels, start=1):
        decided &= np.abs(np.abs(interpret.field(program, points, i)) - level.delta) > TOLERANCE
    return points[decided]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: f"{len(model.levels)} levels")
def test_the_nested_field_matches_the_reference(model: Model) -> None:
    levels, deltas = levels_and_deltas(model)
    points, program = decided_points(model), lower(model)
    for count in range(1, len(levels) + 1):
        expected, expected_level = interpret.nested_field(program, points, count)
        assert set(expected_level) == set(range(1, count + 1)), "the points must reach every level"
        f, reached = nested_field(levels[:count], deltas, torch.from_numpy(points))
        np.testing.assert_array_equal(reached.numpy(), expected_level)
        np.testing.assert_allclose(f.numpy(), expected, atol=TOLERANCE)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: f"{len(model.levels)} levels")
def test_the_nested_gradient_matches_the_finest_defined_level(model: Model) -> None:
    levels, deltas = levels_and_deltas(model)
    points, program = decided_points(model), lower(model)
    f, gradient, reached = nested_field_and_gradient(levels, deltas, torch.from_numpy(points))
    expected, expected_level = interpret.nested_field(program, points, len(levels))
    np.testing.assert_array_equal(reached.numpy(), expected_level)
    np.testing.assert_allclose(f.numpy(), expected, atol=TOLERANCE)
    for level in range(1, len(levels) + 1):
        here = expected_level == level
        expected_gradient, _ = interpret.field_gradient(program, points[here], level)
        np.testing.assert_allclose(gradient.numpy()[here], expected_gradient, atol=10 * TOLERANCE)


@pytest.mark.parametrize("model", MODELS[1:], ids=lambda model: f"{len(model.levels)} levels")
def test_in_band_is_where_the_next_level_is_defined(model: Model) -> None:
    levels, deltas = levels_and_deltas(model)
    points, program = decided_points(model), lower(model)
    for count in range(1, len(levels)):
        _, reached = interpret.nested_field(program, points, count + 1)
        inside = in_band(levels[:count], deltas[:count], torch.from_numpy(points))
        np.testing.assert_array_equal(inside.numpy(), reached == count + 1)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: f"{len(model.levels)} levels")
def test_the_sum_of_all_levels_matches_the_reference(model: Model) -> None:
    levels, _ = levels_and_deltas(model)
    points, program = decided_points(model), lower(model)
    f, gradient = field_and_gradient(levels, torch.from_numpy(points))
    expected_gradient, expected = interpret.field_gradient(program, points, len(levels))
    np.testing.assert_allclose(f.numpy(), expected, atol=TOLERANCE)
    np.testing.assert_allclose(gradient.numpy(), expected_gradient, atol=10 * TOLERANCE)
    np.testing.assert_allclose(field(levels, torch.from_numpy(points)).numpy(), expected, atol=TOLERANCE)


def test_without_levels_every_point_is_in_the_band() -> None:
    assert in_band([], [], torch.zeros(3, 3)).all()
