"""A residual is also taught at strays, far from the surface, where the level before is wrongly near zero."""

from pathlib import Path

import numpy as np
import torch

from mplicits.trainer import pools
from mplicits.trainer.before import REACH, Before
from support.ball_training import load_ball


def test_strays_are_sampled_and_their_distance_is_bounded(tmp_path: Path) -> None:
    ball = load_ball(tmp_path)
    zero = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.zeros(1)]
    delta = 0.02
    sampler = pools.Sampler(ball, [zero], [delta], torch.device("cpu"), np.random.default_rng(0))
    pool = sampler.volume(4000)
    assert pool.distance is not None
    radii = pool.points.norm(dim=1)
    far = (radii - 1).abs() > 4 * delta
    assert 0.06 < far.double().mean() < 0.2, "f = 0 everywhere is a band without end"
    assert float(pool.distance.abs().max()) <= REACH * delta * 1.0001
    assert (pool.distance[far].sign() == (radii[far] - 1).sign()).all()


def test_the_band_of_nested_levels_lies_in_that_of_the_first() -> None:
    """By Eq. 3, f_2 is not defined where f_1 has left its band, whatever the value of f_2."""
    one = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.ones(1)]
    minus_one = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), -torch.ones(1)]
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    assert not Before([one, minus_one], [0.5, 0.1], torch.device("cpu")).in_band(points).any()
    assert Before([one, minus_one], [1.5, 0.1], torch.device("cpu")).in_band(points).all()
