"""Trainings that do not run straight through: Ctrl-C, resuming, collapse and restart."""

import dataclasses

import numpy as np
import pytest

from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.trainer.config import StepConfig
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.train import Training
from mplicits.trainer.training_samples import Sampler
from support.ball_training import QUICK, SMALL_SETTINGS, Log, train

pytestmark = pytest.mark.usefixtures("prepared")


@pytest.fixture(scope="module")
def first(ball: Shape) -> Model:
    """Train level 1 alone."""
    return train(
        ball,
        dataclasses.replace(SMALL_SETTINGS, networks=SMALL_SETTINGS.networks[:1], omegas=SMALL_SETTINGS.omegas[:1]),
    )


@pytest.mark.parametrize(("stage", "levels"), [("level 1", 1), ("level 2", 2)])
def test_ctrl_c_keeps_what_is_trained_and_resuming_finishes_it(
    ball: Shape, model: Model, stage: str, levels: int
) -> None:
    training = Training(ball, SMALL_SETTINGS, Log(stage, 0.5), config=QUICK)
    stopped = training.run()
    assert training.interrupted
    assert stopped.provenance["interrupted"]
    assert len(stopped.levels) == levels
    assert stopped.provenance["levels"][-1]["fraction"] == pytest.approx(0.5, abs=0.1)
    on_surface = interpret.field(lower(stopped), ball.inputs().astype(np.float32), levels)
    assert np.abs(on_surface).max() < stopped.levels[-1].delta
    log = Log()
    resumed = train(ball, log=log, resume=stopped)
    assert log.stages[0].startswith(stage)
    assert len(resumed.levels) == 2
    assert not resumed.provenance["interrupted"]
    assert resumed.provenance["levels"][-1]["fraction"] == 1
    assert resumed.provenance["levels"][1]["mean_f"] < 2 * model.provenance["levels"][1]["mean_f"]


def test_ctrl_c_before_the_first_step_is_passed_on(ball: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    def press(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Sampler, "surface", press)
    with pytest.raises(KeyboardInterrupt):
        train(ball)


def test_resuming_refuses_another_shape_or_other_levels(ball: Shape, model: Model) -> None:
    with pytest.raises(UserError, match="another shape"):
        train(load_shape("demo")[0], resume=model)
    with pytest.raises(UserError, match="16x1,16x1"):
        train(ball, dataclasses.replace(SMALL_SETTINGS, networks=((16, 2), (16, 1))), resume=model)
    with pytest.raises(UserError, match="no record of its training"):
        train(ball, resume=dataclasses.replace(model, provenance={}))


@pytest.mark.slow
def test_a_collapsed_residual_is_restarted(ball: Shape, first: Model) -> None:
    """A rate that is a hundred times too high fails; the log says so, and the restart at a lower rate helps."""
    config = dataclasses.replace(QUICK, step=dataclasses.replace(QUICK.step, rate=100 * StepConfig.rate))
    log = Log()
    model = train(ball, dataclasses.replace(SMALL_SETTINGS, steps=(150, 300, 60)), log, first, config)
    assert any("restarted with rate" in line for line in log.lines)
    second = model.provenance["levels"][1]
    assert second["restarts"] == len([line for line in log.lines if "restarted" in line])
    assert second["rate"] < config.step.rate
    assert second["mean_f"] < model.provenance["levels"][0]["mean_f"]


def test_a_residual_that_never_helps_ends_as_zero(ball: Shape, first: Model) -> None:
    log, config = Log(), dataclasses.replace(QUICK, step=dataclasses.replace(QUICK.step, rate=1e6))
    model = train(ball, dataclasses.replace(SMALL_SETTINGS, steps=(60, 100, 60)), log, first, config)
    assert any("adds nothing" in line for line in log.lines)
    assert not model.levels[1].network[-1].weight.any()
    assert model.provenance["levels"][1]["mean_f"] == model.provenance["levels"][0]["mean_f"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"levels": [{"fraction": 1.0}]}, "no record of its training"),
        ({"levels": [None]}, "no record of its training"),
        ({"levels": "12"}, "no record of its training"),
        ({"levels": [{"fraction": -5.0}]}, "no record of its training"),
        ({"seconds": "long"}, ""),
        ({"texture": {"fraction": 1}}, ""),
    ],
)
def test_a_doctored_record_is_one_line_or_ignored(
    ball: Shape, first: Model, change: dict[str, object], said: str
) -> None:
    doctored = dataclasses.replace(first, provenance=first.provenance | change)
    if said:
        with pytest.raises(UserError, match=said):
            train(ball, resume=doctored)
        return
    brief = dataclasses.replace(SMALL_SETTINGS, steps=(20, 20, 20))
    assert len(train(ball, brief, resume=doctored).levels) == 2
