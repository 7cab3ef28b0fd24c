"""Dithering (Fig. 3a) on a sphere."""

import numpy as np
import pytest

from mplicits.model.errors import UserError
from mplicits.trainer import sampling
from mplicits.trainer.shapes.shape import Doubles, unit


def sphere(points: Doubles) -> Doubles:
    """Compute the signed distance to a sphere of radius 0.5."""
    return np.asarray(np.linalg.norm(points, axis=1) - 0.5)


def on_sphere(count: int) -> Doubles:
    return 0.5 * unit(np.random.default_rng(0).normal(size=(count, 3)))


def test_dithered_samples_are_in_the_band_and_fill_it() -> None:
    delta = 0.05
    drawn = sampling.dithered(
        on_sphere(500), delta, lambda x: np.abs(sphere(x)) < delta, 3000, np.random.default_rng(0)
    )
    assert drawn.shape == (3000, 3)
    assert (np.abs(sphere(drawn)) < delta).all()
    assert sphere(drawn).min() < -0.9 * delta
    assert sphere(drawn).max() > 0.9 * delta


def test_dithering_reaches_two_delta_from_a_point() -> None:
    drawn = sampling.dithered(np.zeros((1, 3)), 0.05, lambda x: np.ones(len(x), bool), 2000, np.random.default_rng(0))
    assert 0.099 < np.abs(drawn).max() <= 0.1


def test_dithering_gives_up_on_an_empty_band() -> None:
    with pytest.raises(UserError, match="too few sample points"):
        sampling.dithered(on_sphere(10), 0.05, lambda x: np.zeros(len(x), bool), 10, np.random.default_rng(0))
