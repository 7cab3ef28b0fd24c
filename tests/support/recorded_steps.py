"""Steps of a residual on a ball, with events that change what a recording of them depends on."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
import torch
from torch import Tensor
from torch.nn.functional import normalize

from mplicits.trainer.config import LossConfig
from mplicits.trainer.level import LevelStep
from mplicits.trainer.networks import replay
from mplicits.trainer.networks.muon import Muon
from mplicits.trainer.networks.network import Weights, clone, initial
from mplicits.trainer.networks.replay import WARM_UP
from mplicits.trainer.texture import TextureStep
from mplicits.trainer.training_samples import Pool

CALLS = WARM_UP + 3
"""Steps between two events: some of them replay a recording."""


def pool(count: int, seed: int, device: torch.device) -> Pool:
    """Draw points around a ball, with normals and colors, and with values of an earlier level that is zero."""
    points = torch.randn(count, 3, generator=torch.Generator().manual_seed(seed)).to(device)
    zero = torch.zeros(count, device=device)
    return Pool(points, points.norm(dim=1) - 1, normalize(points, dim=1), zero, 0 * points, points.clamp(0, 1))


def level_steps(device: torch.device) -> tuple[list[float], list[Tensor]]:
    """Train a residual: then with hard examples, others, another loss, and anew. Returns losses and weights."""
    step = LevelStep(
        pool(256, 0, device), pool(256, 1, device), LossConfig.residual, torch.Generator().manual_seed(2), batch=64
    )
    start = [w.to(device) for w in initial((16, 2), 10.0, 1, torch.Generator().manual_seed(3))]
    losses, trained = list[float](), list[Tensor]()
    first, again = clone(start), clone(start)
    optimizers = Muon(first, 1e-3, 0.1), Muon(again, 1e-3, 0.1)

    def take_steps(weights: Weights, optimizer: Muon) -> None:
        for i in range(CALLS):
            losses.extend((step(weights), *step.terms.values()))
            optimizer.step(1 - 0.1 * i)
        trained.extend(clone(weights))

    take_steps(first, optimizers[0])
    step.hard = pool(40, 4, device)
    take_steps(first, optimizers[0])
    step.hard, step.hard_share = pool(50, 5, device), 0.5
    take_steps(first, optimizers[0])
    step.weight = replace(step.weight, value=7 * step.weight.value, length=1.5)
    take_steps(first, optimizers[0])
    take_steps(again, optimizers[1])
    trained.extend(first)
    return losses, trained


def texture_steps(device: torch.device) -> tuple[list[float], list[Tensor]]:
    """Train a texture. Returns losses and weights."""
    step = TextureStep(pool(256, 0, device), pool(256, 1, device), torch.Generator().manual_seed(2))
    weights = [w.to(device) for w in initial((16, 1), 10.0, 3, torch.Generator().manual_seed(3))]
    optimizer, losses = Muon(weights, 1e-3, 0.1), list[float]()
    for i in range(CALLS):
        losses.extend((step(weights), *step.terms.values()))
        optimizer.step(1 - 0.1 * i)
    return losses, weights


def pretend_to_record(patch: pytest.MonkeyPatch) -> list[int]:
    """Let functions on the CPU be recorded: to replay one is to run it. Returns a list that holds replays of each."""
    replays: list[int] = []

    def record(function: Callable[[], Any]) -> tuple[Callable[[], None], Tensor]:
        index, result = len(replays), torch.empty(0)
        replays.append(0)

        def launch() -> None:
            replays[index] += 1
            found = function()
            if found is not None:
                result.resize_(found.shape).copy_(found)

        return launch, result

    patch.setattr(replay, "record", record)
    patch.setattr("mplicits.trainer.networks.replay.records", lambda _: True)
    patch.setattr("mplicits.trainer.networks.muon.records", lambda _: True)
    return replays
