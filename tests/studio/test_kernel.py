"""The WebAssembly kernel in another runtime than a browser's (Wasmtime), against torch in 64 bits."""

from pathlib import Path

import numpy as np
import pytest
import torch
import wasmtime
from torch import Tensor

from mplicits.trainer.networks.muon import ITERATIONS, orthogonal
from mplicits.web.compile_kernel import SOURCE, compile_kernel
from support import needs, training_steps
from support.training_steps import COUNT, ON, SMOOTHNESS, WEIGHT, assert_near, level_samples, network, texture_samples

KERNEL = SOURCE.with_suffix(".wasm")


class Kernel:
    """The kernel with at most one network."""

    def __init__(self, weights: list[Tensor] | None = None) -> None:
        store = wasmtime.Store()
        module = wasmtime.Module.from_file(store.engine, str(KERNEL))
        self._exports, self._store = wasmtime.Instance(store, module, []).exports(store), store
        if not weights:
            return
        width, outputs = len(weights[0]), len(weights[-1])
        self.call("prepare", width, len(weights) // 2 - 2, outputs, COUNT)
        packed = training_steps.packed(weights)
        self.floats("weights_at", len(packed))[:] = packed
        self._weights = weights

    def call(self, name: str, *arguments: float) -> int:
        """Call a function of the kernel."""
        return self._exports[name](self._store, *arguments)  # type: ignore[operator, no-any-return]

    def floats(self, at: str, count: int, *arguments: int) -> np.ndarray:
        """Return a view of `count` floats of the kernel's memory. at: the function that returns the address."""
        start = self.call(at, *arguments)
        memory = self._exports["memory"]
        assert isinstance(memory, wasmtime.Memory)
        whole = np.ctypeslib.as_array(memory.data_ptr(self._store), shape=(memory.data_len(self._store),))
        return whole[start:][: 4 * count].view(np.float32)

    def gradient(self) -> list[np.ndarray]:
        """Return the gradient in the shapes of the weights."""
        count = sum(w.numel() for w in self._weights)
        return training_steps.unpacked(self.floats("gradient_at", count).copy(), self._weights)


def run_level(weights: list[Tensor], samples: np.ndarray, on: int) -> Kernel:
    kernel, weight = Kernel(weights), WEIGHT
    kernel.floats("samples_at", samples.size)[:] = samples.ravel()
    kernel.floats("factors_at", 8)[:] = [
        *(weight.value, weight.normal, weight.distance, weight.eikonal),
        *(weight.length, weight.excess, weight.lacking, weight.near),
    ]
    kernel.call("level_step", len(samples), on, float(ON), float(COUNT - ON))
    return kernel


@pytest.mark.parametrize(("width", "depth"), [(8, 0), (16, 1), (64, 2), (20, 3)])
def test_the_level_step_equals_autograd(width: int, depth: int) -> None:
    weights, samples = network(width, depth, 1), level_samples()
    kernel = run_level(weights, samples, ON)

    truth = training_steps.level_truth(weights, samples)
    assert_near(kernel.gradient(), truth.gradient)
    np.testing.assert_allclose(kernel.floats("terms_at", 4), truth.terms, rtol=1e-5)

    kernel.call("evaluate", COUNT)
    results = kernel.floats("results_at", 4 * COUNT).reshape(COUNT, 4)
    np.testing.assert_allclose(results[:, 0], truth.values, atol=1e-6)
    assert truth.slope is not None
    np.testing.assert_allclose(results[:, 1:], truth.slope[:, :3], atol=1e-4)


@pytest.mark.slow
def test_the_compiled_kernel_is_that_of_the_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same compiler makes the same bytes; another one makes the same numbers."""
    needs.program("clang")
    needs.program("lld")
    compile_kernel(tmp_path / "siren.wasm")
    if (tmp_path / "siren.wasm").read_bytes() != KERNEL.read_bytes():
        monkeypatch.setattr(f"{__name__}.KERNEL", tmp_path / "siren.wasm")
        test_the_level_step_equals_autograd(16, 1)
        test_the_texture_step_equals_autograd(16, 2)


def test_shares_of_a_batch_add_up() -> None:
    weights, samples = network(16, 2, 1), level_samples()
    whole = run_level(weights, samples, ON).gradient()
    shares = [run_level(weights, samples[:ON], ON).gradient(), run_level(weights, samples[ON:], 0).gradient()]
    for all_of_it, one, other in zip(whole, *shares, strict=True):
        np.testing.assert_allclose(one + other, all_of_it, atol=1e-5 * np.abs(all_of_it).max())


@pytest.mark.parametrize(("width", "depth"), [(12, 0), (16, 2)])
def test_the_texture_step_equals_autograd(width: int, depth: int) -> None:
    weights, samples = network(width, depth, 3), texture_samples()
    kernel = Kernel(weights)
    kernel.floats("samples_at", samples.size)[:] = samples.ravel()
    kernel.call("texture_step", COUNT, ON, float(ON), float(COUNT), SMOOTHNESS)

    truth = training_steps.texture_truth(weights, samples)
    assert_near(kernel.gradient(), truth.gradient)
    np.testing.assert_allclose(kernel.floats("terms_at", 2), truth.terms, rtol=1e-5)

    kernel.call("evaluate", COUNT)
    results = kernel.floats("results_at", 4 * COUNT).reshape(COUNT, 4)
    np.testing.assert_allclose(results[:, :3], truth.values, atol=1e-6)


@pytest.mark.parametrize("width", [4, 8, 12, 44, 64])
def test_matrices_become_nearly_orthogonal(width: int) -> None:
    matrices = np.random.default_rng(width).normal(scale=1e-5, size=(4, width, width)).astype(np.float32)
    matrices[1, -3:] = matrices[1, :, -3:] = 0  # padding neurons
    matrices[2] = 0
    kernel = Kernel()
    ours = kernel.floats("prepare_matrices", matrices.size, len(matrices), width)
    ours[:] = matrices.ravel()
    kernel.call("orthogonalize", ITERATIONS)
    ours = ours.reshape(matrices.shape)
    np.testing.assert_allclose(ours, orthogonal(torch.from_numpy(matrices).double()).numpy(), atol=2e-5)
    assert not ours[1, -3:].any()
    assert not ours[1, :, -3:].any()
