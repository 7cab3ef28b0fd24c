"""Recorded steps are the steps themselves: the recording is pretended, on the CPU."""

import pytest
import torch
from torch import Tensor

from mplicits.trainer.networks import replay
from mplicits.trainer.networks.muon import Muon
from mplicits.trainer.networks.network import clone, initial
from mplicits.trainer.networks.replay import WARM_UP, Replay
from mplicits.trainer.networks.snapshot import Snapshot
from support.recorded_steps import CALLS, level_steps, pretend_to_record, texture_steps

CPU = torch.device("cpu")


def weights(number: float) -> list[Tensor]:
    made = torch.full((2,), number)
    made.grad = torch.zeros(2)
    return [made]


def add(weights: list[Tensor], factor: float, points: Tensor, more: Tensor | None) -> Tensor:
    """Add to the gradient, and return a number."""
    assert weights[0].grad is not None
    weights[0].grad += points.sum()
    return (factor * weights[0] * points.sum() + (0 if more is None else more)).sum().reshape(1)


def gradient(weights: list[Tensor]) -> float:
    assert weights[0].grad is not None
    return float(weights[0].grad[0])


def test_every_call_is_one_step_with_its_own_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    replays, run = pretend_to_record(monkeypatch), Replay()
    first, second = weights(1.0), weights(2.0)
    for call in range(CALLS):
        assert run(add, first, 3.0, torch.full((4,), float(call)), None).item() == 3 * 2 * 4 * call
    assert replays == [CALLS - WARM_UP]
    assert gradient(first) == 4 * sum(range(CALLS))
    for expected, changed, points, more in (
        (2 * 5 * 4, first, torch.ones(4), None),
        (2 * 5 * 6, first, torch.ones(6), None),
        (2 * (5 * 6 + 1), first, torch.ones(6), torch.ones(2)),
        (2 * (5 * 2 * 6 + 1), second, torch.ones(6), torch.ones(2)),
    ):
        assert [run(add, changed, 5.0, points, more).item() for _ in range(CALLS)] == [expected] * CALLS
    assert replays == 5 * [CALLS - WARM_UP]
    assert gradient(first) == 4 * sum(range(CALLS)) + CALLS * (4 + 6 + 6)
    assert gradient(second) == CALLS * 6


def test_a_gradient_elsewhere_is_recorded_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    replays, run, first = pretend_to_record(monkeypatch), Replay(), weights(1.0)
    for _ in range(CALLS):
        run(add, first, 1.0, torch.ones(4), None)
    before, first[0].grad = first[0].grad, torch.zeros(2)
    run(add, first, 1.0, torch.ones(4), None)
    assert before is not None
    assert (float(before[0]), gradient(first)) == (4 * CALLS, 4)
    assert replays == [CALLS - WARM_UP]


def test_what_cannot_be_recorded_runs_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend_to_record(monkeypatch)
    attempts = []

    def fail(_: object) -> None:
        attempts.append(1)
        raise RuntimeError("operation not permitted when stream is capturing")

    monkeypatch.setattr(replay, "record", fail)
    run, first = Replay(), weights(1.0)
    for _ in range(CALLS):
        assert run(add, first, 1.0, torch.ones(4), None).item() == 8
    assert gradient(first) == 4 * CALLS
    assert len(attempts) == 1
    assert "not permitted" in run.failure


def test_recorded_steps_of_a_level_are_those_of_the_cpu(monkeypatch: pytest.MonkeyPatch) -> None:
    losses, trained = level_steps(CPU)
    replays = pretend_to_record(monkeypatch)
    recorded_losses, recorded = level_steps(CPU)
    assert sum(replays) > 5 * (CALLS - WARM_UP)
    torch.testing.assert_close(recorded_losses, losses, rtol=1e-4, atol=1e-6)
    torch.testing.assert_close(recorded, trained, rtol=1e-4, atol=1e-5)


def test_recorded_steps_of_a_texture_are_those_of_the_cpu(monkeypatch: pytest.MonkeyPatch) -> None:
    losses, trained = texture_steps(CPU)
    replays = pretend_to_record(monkeypatch)
    recorded_losses, recorded = texture_steps(CPU)
    assert len(replays) == 2
    torch.testing.assert_close(recorded_losses, losses, rtol=1e-4, atol=1e-6)
    torch.testing.assert_close(recorded, trained, rtol=1e-4, atol=1e-5)


def test_a_recorded_optimizer_continues_from_a_snapshot(monkeypatch: pytest.MonkeyPatch) -> None:
    replays = pretend_to_record(monkeypatch)
    generator = torch.Generator().manual_seed(0)
    ours = initial((16, 2), 10.0, 1, generator)
    gradients = [[torch.randn(weight.shape, generator=generator) for weight in ours] for _ in range(2 * CALLS)]
    optimizer = Muon(ours, 1e-2, 0.1)

    def take_steps(drawn: list[list[Tensor]]) -> list[Tensor]:
        for step in drawn:
            for weight, gradient in zip(ours, step, strict=True):
                assert weight.grad is not None
                weight.grad.copy_(gradient)
            optimizer.step(0.5)
        return clone(ours)

    before = take_steps(gradients[:CALLS])
    state = {name: tensor.clone() for name, tensor in optimizer.snapshot().tensors.items()}
    expected = take_steps(gradients[CALLS:])
    for weight, earlier in zip(ours, before, strict=True):
        weight.copy_(earlier)
    places = {name: tensor.data_ptr() for name, tensor in optimizer.snapshot().tensors.items()}
    optimizer.restore(Snapshot(tensors=state))
    assert places == {name: tensor.data_ptr() for name, tensor in optimizer.snapshot().tensors.items()}
    assert all(torch.equal(a, b) for a, b in zip(take_steps(gradients[CALLS:]), expected, strict=True))
    assert replays == [3 * CALLS - WARM_UP]
