"""The ball that several tests of the trainer train, and a quick configuration."""

from collections.abc import Iterator

import pytest
import torch

from mplicits.model.model import Model
from mplicits.trainer import machine
from mplicits.trainer.shapes.shape import Shape
from support.ball_training import load_ball, train, use_quick_config


@pytest.fixture(scope="module")
def prepared() -> None:
    machine.prepare(torch.device("cpu"))


@pytest.fixture(scope="session")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Shape:
    return load_ball(tmp_path_factory.mktemp("ball"))


@pytest.fixture(scope="session")
def model(ball: Shape) -> Model:
    """The trained ball."""
    machine.prepare(torch.device("cpu"))
    return train(ball)


@pytest.fixture(scope="module")
def quick() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        use_quick_config(patch)
        yield
