"""Training on a GPU, pretended: no operation mixes tensors of two devices, and the weights are those of the CPU."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from mplicits.model.model import Network
from mplicits.trainer.shapes.load import load_shape
from support.ball_training import QUICK, SMALL_SETTINGS, train
from support.pretended_gpu import DEVICE, PretendedGpu


def test_the_pretended_gpu_refuses_tensors_of_the_cpu() -> None:
    with PretendedGpu():
        points, weights = torch.rand(5, 3).to(DEVICE), torch.rand(4, 3).to(DEVICE).requires_grad_()
        (points @ weights.t()).sin().square().mean().backward()  # type: ignore[no-untyped-call]
        assert weights.grad is not None
        expected = weights.detach().cpu().requires_grad_()
        (points.cpu() @ expected.t()).sin().square().mean().backward()  # type: ignore[no-untyped-call]
        assert expected.grad is not None
        assert torch.equal(weights.grad.cpu(), expected.grad)
        with pytest.raises(RuntimeError, match="on the CPU and on the GPU"):
            points @ torch.rand(3, 4)
        with pytest.raises(RuntimeError, match="generator"):
            torch.rand(3, device=DEVICE, generator=torch.Generator())


@pytest.mark.slow
def test_a_training_stays_on_the_gpu(monkeypatch: pytest.MonkeyPatch) -> None:
    shape, settings = load_shape("demo")[0], replace(SMALL_SETTINGS, steps=(12, 12, 6))
    expected = train(shape, settings, config=QUICK)
    monkeypatch.setattr("mplicits.trainer.train.device", lambda _: DEVICE)
    with PretendedGpu():
        found = train(shape, settings, config=QUICK)
    assert found.texture is not None
    assert expected.texture is not None

    def weights(network: Network) -> NDArray[np.float32]:
        return np.concatenate([layer.weight.ravel() for layer in network])

    for ours, theirs in zip(found.levels, expected.levels, strict=True):
        assert np.abs(weights(ours.network) - weights(theirs.network)).max() < 1e-4
    assert np.abs(weights(found.texture) - weights(expected.texture)).max() < 1e-4
