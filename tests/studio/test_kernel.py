"""Tests of the WebAssembly kernel in another runtime than a browser's (Wasmtime), against torch.autograd in 64 bits."""

from pathlib import Path
from shutil import which

import numpy as np
import pytest
import torch
import wasmtime
from torch import Tensor

from mplicits.studio.compile import SOURCE, compile_kernel
from mplicits.trainer.config import LossWeights
from mplicits.trainer.level import level_loss
from mplicits.trainer.networks.network import initial, value
from mplicits.trainer.texture import texture_loss
from mplicits.trainer.training_samples import Pool

KERNEL = SOURCE.with_suffix(".wasm")
COUNT, ON = 128, 64
"""Samples of a batch, and the first of them that lie on the surface."""
WEIGHT = LossWeights(100.0, 10.0, 3.0, 40.0, excess=4.0, lacking=2.5, length=1.7, near=0.05)


class Kernel:
    """The kernel with one network."""

    def __init__(self, weights: list[Tensor]) -> None:
        store = wasmtime.Store()
        module = wasmtime.Module.from_file(store.engine, str(KERNEL))
        self._exports, self._store = wasmtime.Instance(store, module, []).exports(store), store
        width, outputs = len(weights[0]), len(weights[-1])
        self.call("prepare", width, len(weights) // 2 - 2, outputs, COUNT)
        packed = np.concatenate([w.detach().numpy().astype(np.float32).ravel() for w in weights])
        self.floats("weights_at", len(packed))[:] = packed
        self._shapes = [w.shape for w in weights]

    def call(self, name: str, *arguments: float) -> int:
        """Call a function of the kernel."""
        return self._exports[name](self._store, *arguments)  # type: ignore[operator, no-any-return]

    def floats(self, at: str, count: int) -> np.ndarray:
        """Return a view of `count` floats of the kernel's memory. at: the function that returns the address."""
        memory = self._exports["memory"]
        assert isinstance(memory, wasmtime.Memory)
        whole = np.ctypeslib.as_array(memory.data_ptr(self._store), shape=(memory.data_len(self._store),))
        return whole[self.call(at) :][: 4 * count].view(np.float32)

    def gradient(self) -> list[np.ndarray]:
        """Return the gradient in the shapes of the weights."""
        sizes = [shape.numel() for shape in self._shapes]
        parts = np.split(self.floats("gradient_at", sum(sizes)).copy(), np.cumsum(sizes)[:-1])
        return [part.reshape(shape) for part, shape in zip(parts, self._shapes, strict=True)]


def network(width: int, depth: int, outputs: int) -> list[Tensor]:
    weights = initial((width, depth), 30.0, outputs, torch.Generator().manual_seed(width), moving=True)
    return [w.double().requires_grad_() for w in weights]


def random_samples() -> np.ndarray:
    """Return samples (COUNT, 12): point, time, f and grad f of the levels before, distance, normal."""
    samples = np.random.default_rng(1).uniform(-1, 1, (COUNT, 12))
    samples[:, 4:9] *= 0.3
    samples[:ON, 8] *= 0.01
    samples[[3, -3], 8] = np.nan
    samples[:, 9:] /= np.linalg.norm(samples[:, 9:], axis=1, keepdims=True)
    return samples.astype(np.float32)


def run_level(weights: list[Tensor], samples: np.ndarray, on: int) -> Kernel:
    kernel, weight = Kernel(weights), WEIGHT
    kernel.floats("samples_at", samples.size)[:] = samples.ravel()
    kernel.floats("factors_at", 8)[:] = [
        *(weight.value, weight.normal, weight.distance, weight.eikonal),
        *(weight.length, weight.excess, weight.lacking, weight.near),
    ]
    kernel.call("level_step", len(samples), on, float(ON), float(COUNT - ON))
    return kernel


def assert_near(kernel: list[np.ndarray], expected: tuple[Tensor, ...]) -> None:
    for ours, truth in zip(kernel, expected, strict=True):
        np.testing.assert_allclose(ours, truth.numpy(), atol=1e-5 * truth.abs().max().item())


@pytest.mark.parametrize(("width", "depth"), [(8, 0), (16, 1), (64, 2), (20, 3)])
def test_the_level_step_equals_autograd(width: int, depth: int) -> None:
    weights, samples = network(width, depth, 1), random_samples()
    kernel = run_level(weights, samples, ON)

    rows = torch.from_numpy(samples.astype(np.float64))
    points = rows[:, :4].clone().requires_grad_()
    f = value(weights, points)[:, 0]
    (slope,) = torch.autograd.grad(f.sum(), points, create_graph=True)
    gradient = slope + torch.cat((rows[:, 5:8], torch.zeros(COUNT, 1)), dim=1)
    pool = Pool(points, rows[:, 8], rows[:, 9:], rows[:, 4], rows[:, 5:8])
    on, around = pool.take(slice(ON)), pool.take(slice(ON, None))
    with torch.no_grad():
        _, d_f, d_gradient, terms = level_loss(f + rows[:, 4], gradient, on, around, WEIGHT)
    assert_near(kernel.gradient(), torch.autograd.grad((f, slope), weights, (d_f, d_gradient)))
    np.testing.assert_allclose(kernel.floats("terms_at", 4), [float(term) for term in terms.values()], rtol=1e-5)

    kernel.call("evaluate", COUNT)
    results = kernel.floats("results_at", 4 * COUNT).reshape(COUNT, 4)
    np.testing.assert_allclose(results[:, 0], f.detach(), atol=1e-6)
    np.testing.assert_allclose(results[:, 1:], slope[:, :3].detach(), atol=1e-4)


@pytest.mark.slow
@pytest.mark.skipif(not (which("clang") and which("wasm-ld")), reason="clang and lld are not installed")
def test_the_compiled_kernel_is_that_of_the_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same compiler makes the same bytes; another one makes the same numbers."""
    compile_kernel(tmp_path / "siren.wasm")
    if (tmp_path / "siren.wasm").read_bytes() != KERNEL.read_bytes():
        monkeypatch.setattr(f"{__name__}.KERNEL", tmp_path / "siren.wasm")
        test_the_level_step_equals_autograd(16, 1)
        test_the_texture_step_equals_autograd(16, 2)


def test_shares_of_a_batch_add_up() -> None:
    weights, samples = network(16, 2, 1), random_samples()
    whole = run_level(weights, samples, ON).gradient()
    shares = [run_level(weights, samples[:ON], ON).gradient(), run_level(weights, samples[ON:], 0).gradient()]
    for all_of_it, one, other in zip(whole, *shares, strict=True):
        np.testing.assert_allclose(one + other, all_of_it, atol=1e-5 * np.abs(all_of_it).max())


@pytest.mark.parametrize(("width", "depth"), [(12, 0), (16, 2)])
def test_the_texture_step_equals_autograd(width: int, depth: int) -> None:
    weights, samples, smoothness = network(width, depth, 3), random_samples(), 0.02
    samples[:, 8:11] = np.abs(samples[:, 9:])
    kernel = Kernel(weights)
    kernel.floats("samples_at", samples.size)[:] = samples.ravel()
    kernel.call("texture_step", COUNT, ON, float(ON), float(COUNT), smoothness)

    rows = torch.from_numpy(samples.astype(np.float64))
    points, directions, truth = rows[:, :4].clone().requires_grad_(), rows[:, 4:8], rows[:ON, 8:11]
    colors = value(weights, points)
    slopes = [torch.autograd.grad(channel.sum(), points, create_graph=True)[0] for channel in colors.T]
    along = torch.stack([(slope * directions).sum(1) for slope in slopes], dim=1)
    with torch.no_grad():
        _, d_colors, d_along, terms = texture_loss(colors, along.clone(), truth, smoothness)
    assert_near(kernel.gradient(), torch.autograd.grad((colors, along), weights, (d_colors, d_along)))
    np.testing.assert_allclose(kernel.floats("terms_at", 2), [float(term) for term in terms.values()], rtol=1e-5)

    kernel.call("evaluate", COUNT)
    results = kernel.floats("results_at", 4 * COUNT).reshape(COUNT, 4)
    np.testing.assert_allclose(results[:, :3], colors.detach(), atol=1e-6)
