"""The ball that several tests of the trainer train, and a quick configuration."""

from collections.abc import Iterator

import pytest

from mplicits.trainer.shapes.shape import Shape
from support.ball_training import load_ball, use_quick_config


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    return load_ball(tmp_path_factory.mktemp("ball"))


@pytest.fixture(scope="module")
def quick() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        use_quick_config(patch)
        yield
