"""The ball that several tests of the trainer train, and a level of it."""

import pytest

from mplicits.trainer.shapes.shape import Shape
from support.ball_training import load_ball
from support.looked_at import Level, level_of


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    return load_ball(tmp_path_factory.mktemp("ball"))


@pytest.fixture
def level(ball: Shape) -> Level:
    return level_of(ball)
