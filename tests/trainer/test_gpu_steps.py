"""Training steps on a GPU: those that CUDA graphs replay are those that Python launches."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mplicits.trainer.networks import replay
from support.recorded_steps import level_steps, texture_steps

pytestmark = [
    pytest.mark.gpu,
    pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU"),
]


@pytest.mark.parametrize("steps", [level_steps, texture_steps])
def test_replayed_steps_are_those_of_python(
    monkeypatch: pytest.MonkeyPatch, steps: Callable[[torch.device], tuple[list[float], list[Tensor]]]
) -> None:
    device, recordings, record = torch.device("cuda"), list[object](), replay.record

    def counted(function: Callable[[], object]) -> tuple[Callable[[], None], object]:
        made = record(function)
        recordings.append(made)
        return made

    monkeypatch.setattr(replay, "record", counted)
    losses, trained = steps(device)
    assert len(recordings) >= 2, "a step cannot be recorded"
    with monkeypatch.context() as patch:
        patch.setattr(replay, "WARM_UP", 1 << 60)
        launched_losses, launched = steps(device)
    torch.testing.assert_close(losses, launched_losses, rtol=1e-4, atol=1e-6)
    torch.testing.assert_close(trained, launched, rtol=1e-4, atol=1e-5)
    on_cpu_losses, on_cpu = steps(torch.device("cpu"))
    torch.testing.assert_close(losses, on_cpu_losses, rtol=1e-2, atol=1e-4)
    torch.testing.assert_close([weight.cpu() for weight in trained], on_cpu, rtol=1e-2, atol=1e-3)
