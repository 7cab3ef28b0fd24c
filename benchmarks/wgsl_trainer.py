"""The training step of the studio page (web/kernel/step.wgsl) through wgpu, as web/train/gpu_kernel.js runs it."""

import statistics
import struct
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu  # type: ignore[import-untyped]
from numpy.typing import NDArray
from torch import Tensor

from mplicits.trainer.config import StepConfig
from mplicits.web.compile_kernel import SOURCE
from support import training_steps
from support.training_steps import COUNT, ON, SMOOTHNESS, WEIGHT

NETWORKS = {"48x1": (48, 1, 1), "64x2": (64, 2, 1), "64x4": (64, 4, 1), "texture, 64x2": (64, 2, 3)}
"""Name -> width, hidden layers, outputs: the levels and the texture of the preset base, and 64x2 to compare it."""
POINTS, REDUCED = 32, 256
"""As in gpu_kernel.js."""
ALONE = 50
"""Steps in one encoder, to time them without copies."""


@dataclass(frozen=True)
class Network:
    """Size of a network, with outputs: 1 of a level, 3 of a texture."""

    width: int
    depth: int
    outputs: int

    @property
    def operations(self) -> float | None:
        """Floating-point operations of a sample's products, by the head of step.wgsl; None for a texture."""
        return 12 * self.width**2 * self.depth + 48 * self.width if self.outputs == 1 else None


class Trainer:
    """A network in the kernel, with buffers for batches of `count` samples; COUNT of training_steps are repeated."""

    def __init__(self, device: Any, network: Network, weights: NDArray[np.float32], count: int) -> None:
        self._device = device
        text = "const WIDTH = {}u; const DEPTH = {}u; const OUTPUTS = {}u;\n"
        code = text.format(network.width, network.depth, network.outputs) + SOURCE.with_name("step.wgsl").read_text()
        compute = {"module": device.create_shader_module(code=code), "entry_point": "step"}
        self._pipeline = device.create_compute_pipeline(layout="auto", compute=compute)
        self._weights = np.concatenate([weights, np.zeros(-len(weights) % 4, np.float32)])
        self.sums, rows = len(self._weights) + 4, (4 * network.depth + 10) * network.width * POINTS
        most = device.limits["max-storage-buffer-binding-size"] // 4 // max(rows, self.sums)
        self.groups = min(count // POINTS, most)
        usage = wgpu.BufferUsage
        sizes = [4 * 12, 4 * 12 * count, 4 * len(self._weights)]
        sizes += [4 * rows * self.groups, 4 * self.sums * self.groups, 4 * self.sums]
        written = usage.STORAGE | usage.COPY_DST
        usages = [usage.UNIFORM | usage.COPY_DST, written, written]
        usages += [usage.STORAGE, usage.STORAGE, usage.STORAGE | usage.COPY_SRC]
        self._buffers = [device.create_buffer(size=s, usage=u) for s, u in zip(sizes, usages, strict=True)]
        self._result = device.create_buffer(size=sizes[-1], usage=usage.MAP_READ | usage.COPY_DST)
        entries = [{"binding": k, "resource": {"buffer": buffer}} for k, buffer in enumerate(self._buffers)]
        self._bound = device.create_bind_group(layout=self._pipeline.get_bind_group_layout(0), entries=entries)
        factors = [WEIGHT.value, WEIGHT.normal, WEIGHT.distance, WEIGHT.eikonal]
        factors += [WEIGHT.length, WEIGHT.excess, WEIGHT.lacking, WEIGHT.near, SMOOTHNESS]
        self._batch = struct.pack("9f3I", *factors, count, COUNT, ON)

    def step(self, samples: NDArray[np.float32], repeats: int = 1) -> NDArray[np.float32]:
        """Take a step as the page does: write, dispatch, read back. repeats: of the dispatches. Returns the sums."""
        for buffer, data in zip(self._buffers, (self._batch, samples, self._weights), strict=False):
            self._device.queue.write_buffer(buffer, 0, data)
        encoder = self._device.create_command_encoder()
        work = encoder.begin_compute_pass()
        work.set_pipeline(self._pipeline)
        work.set_bind_group(0, self._bound)
        for _ in range(repeats):
            work.dispatch_workgroups(self.groups)
            work.dispatch_workgroups(-(-self.sums // 4 // REDUCED), 2)
        work.end()
        encoder.copy_buffer_to_buffer(self._buffers[-1], 0, self._result, 0, 4 * self.sums)
        self._device.queue.submit([encoder.finish()])
        self._result.map_sync(wgpu.MapMode.READ)
        floats = np.frombuffer(self._result.read_mapped(), np.float32).copy()
        self._result.unmap()
        return floats


def median_ms(work: Callable[[], object], rounds: int) -> float:
    """Return the median of some rounds after the first one, in ms."""
    times = []
    for _ in range(rounds + 1):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return 1e3 * statistics.median(times[1:])


def largest_difference(gradient: NDArray[np.float32], weights: list[Tensor], truth: Sequence[Tensor]) -> float:
    """Return the largest difference of a gradient from the truth, relative to each weight's largest entry."""
    parts = zip(training_steps.unpacked(gradient, weights), truth, strict=True)
    return max(float(np.abs(part - exact.numpy()).max() / exact.abs().max()) for part, exact in parts)


def measure(device: Any, name: str, rounds: int) -> dict[str, Any]:
    """Time a network's step at the batch size of the page, and compare its gradient with autograd's in 64 bits."""
    network, count = Network(*NETWORKS[name]), StepConfig.batch
    weights = training_steps.network(network.width, network.depth, network.outputs)
    is_level = network.outputs == 1
    samples = training_steps.level_samples() if is_level else training_steps.texture_samples()
    truth = (training_steps.level_truth if is_level else training_steps.texture_truth)(weights, samples)
    trainer = Trainer(device, network, training_steps.packed(weights), count)
    batch = np.tile(samples, (count // COUNT, 1))  # its loss is a mean, that of the samples
    sums = trainer.step(batch)
    parameters = sum(weight.numel() for weight in weights)
    page_ms = median_ms(lambda: trainer.step(batch), rounds)
    many_ms = median_ms(lambda: trainer.step(batch, 1 + ALONE), max(1, rounds // 10))
    alone_ms = (many_ms - page_ms) / ALONE
    operations = network.operations
    return {
        "network": name,
        "samples": count,
        "groups": trainer.groups,
        "page_ms": round(page_ms, 4),
        "alone_ms": round(alone_ms, 4),
        "gflops": round(1e-6 * operations * count / alone_ms, 1) if operations else None,
        "difference": largest_difference(sums[:parameters], weights, truth.gradient),
        "loss_difference": abs(float(sums[-4]) / truth.loss - 1),
    }
