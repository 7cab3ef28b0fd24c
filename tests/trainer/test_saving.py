"""A trained model is not lost where the output cannot be written."""

import math
import tempfile
from pathlib import Path

import pytest
import torch

from mplicits.model.errors import UserError
from mplicits.model.model_file import load, save
from mplicits.trainer import session
from mplicits.trainer.networks import fit
from mplicits.trainer.networks.network import Weights
from support.random_model import random_model


def test_a_full_disk_at_the_end_loses_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    model, output, temporary = random_model((4, 0)), tmp_path / "a" / "m.safetensors", tmp_path / "tmp"
    temporary.mkdir()
    (temporary / "m.safetensors").write_text("somebody's")
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))

    def full(saved: object, path: Path) -> None:
        if path == output:
            raise UserError("cannot write m.safetensors: No space left on device")
        save(model, path)

    monkeypatch.setattr(session, "save", full)
    with pytest.raises(UserError, match=r"No space left.*the trained model is in .*m\.safetensors"):
        session._save(model, output)
    (rescue,) = temporary.glob("*/m.safetensors")
    assert load(rescue).sha256() == model.sha256()
    assert (temporary / "m.safetensors").read_text() == "somebody's"


@pytest.mark.parametrize("loss", [1.0, math.nan])
def test_a_network_that_diverges_ends_as_zero(loss: float) -> None:
    def start() -> Weights:
        return [torch.ones(4, 3), torch.ones(4), torch.ones(1, 4), torch.ones(1)]

    def step(weights: Weights) -> float:
        for w in weights:
            w.grad = torch.full_like(w, math.nan)
        return loss

    task = fit.Task(start, step, idle=0.5, rate=1e-3, output_factor=1.0)
    outcome = fit.fit(task, fit.Budget(steps=3), print)
    assert outcome.failed
    assert outcome.loss == task.idle
    for weight, end in zip(outcome.weights, [*start()[:2], torch.zeros(1, 4), torch.zeros(1)], strict=True):
        torch.testing.assert_close(weight, end)
