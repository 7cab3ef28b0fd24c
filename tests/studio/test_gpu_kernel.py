"""Tests of the WebGPU kernel against torch.autograd in 64 bits."""

import struct
from typing import Any

import numpy as np
import pytest
from torch import Tensor

from mplicits.web.compile_kernel import SOURCE
from support import training_steps
from support.compilers import webgpu
from support.training_steps import COUNT, ON, SMOOTHNESS, WEIGHT, assert_near, level_samples, network, texture_samples

ARRAYS, TILE = 4, 32
"""Scratch arrays, and points of a tile, in step.wgsl."""
REDUCED = 256
"""Vectors of four sums that a pair of work groups reduces."""
GROUPS = 3
"""Fewer than the tiles of a batch."""


def step(weights: list[Tensor], samples: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Run the kernel. Returns the gradient, and (loss, mean |f| on the surface)."""
    device: Any = webgpu()
    width, depth, outputs = len(weights[0]), len(weights) // 2 - 2, len(weights[-1])
    text = f"const WIDTH = {width}u; const DEPTH = {depth}u; const OUTPUTS = {outputs}u;\n"
    module = device.create_shader_module(code=text + SOURCE.with_name("step.wgsl").read_text())
    packed = training_steps.packed(weights)
    packed = np.concatenate([packed, np.zeros(-len(packed) % 4, np.float32)])
    sums = 4 * len(packed) + 16
    factors = [WEIGHT.value, WEIGHT.normal, WEIGHT.distance, WEIGHT.eikonal]
    factors += [WEIGHT.length, WEIGHT.excess, WEIGHT.lacking, WEIGHT.near, SMOOTHNESS]
    rows = 4 * GROUPS * (4 * (depth + 1) + 2 + ARRAYS) * width * TILE
    data = [struct.pack("9f3I", *factors, COUNT, COUNT, ON), samples.tobytes(), packed.tobytes()]
    usages = [0x48, 0x88, 0x88, 0x80, 0x80, 0x84]  # uniform, storage; with copies
    buffers = [
        device.create_buffer_with_data(data=part, usage=usage) for part, usage in zip(data, usages, strict=False)
    ]
    sizes = [rows, GROUPS * sums, sums]
    buffers += [device.create_buffer(size=size, usage=usage) for size, usage in zip(sizes, usages[3:], strict=True)]
    pipeline = device.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "step"})
    bound = [{"binding": k, "resource": {"buffer": buffer}} for k, buffer in enumerate(buffers)]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=bound)
    encoder = device.create_command_encoder()
    work = encoder.begin_compute_pass()
    work.set_pipeline(pipeline)
    work.set_bind_group(0, group)
    work.dispatch_workgroups(GROUPS)
    work.dispatch_workgroups(-(-sums // 16 // REDUCED), 2)
    work.end()
    device.queue.submit([encoder.finish()])
    result = np.frombuffer(device.queue.read_buffer(buffers[-1]), np.float32)
    count = sum(w.numel() for w in weights)
    return training_steps.unpacked(result[:count], weights), result[-4:-2]


@pytest.mark.parametrize(("width", "depth"), [(8, 0), (20, 3)])
def test_the_level_step_equals_autograd(width: int, depth: int) -> None:
    weights, samples = network(width, depth, 1), level_samples()
    gradient, (loss, mean_f) = step(weights, samples)
    truth = training_steps.level_truth(weights, samples)
    assert_near(gradient, truth.gradient)
    assert loss == pytest.approx(truth.loss, rel=1e-5)
    errors = np.abs(truth.values[:ON].numpy() + samples[:ON, 4] - samples[:ON, 8])
    assert mean_f == pytest.approx(np.nansum(errors) / ON, rel=1e-5)


@pytest.mark.parametrize(("width", "depth"), [(16, 2)])
def test_the_texture_step_equals_autograd(width: int, depth: int) -> None:
    weights, samples = network(width, depth, 3), texture_samples()
    gradient, (loss, _) = step(weights, samples)
    truth = training_steps.texture_truth(weights, samples)
    assert_near(gradient, truth.gradient)
    assert loss == pytest.approx(truth.loss, rel=1e-5)
