"""Stage of on_gpu.py that runs WGSL by WebGPU on Vulkan: a field, and the trainer of the studio page."""

import time

from gpu_commands import REHEARSAL
from stages import Results


def wgsl(results: Results) -> None:
    """Time the trainer of the studio page, then a field."""
    import wgpu  # type: ignore[import-untyped]

    results.set("adapters", [adapter.summary for adapter in wgpu.gpu.enumerate_adapters_sync()])
    trainer_steps(results)
    evaluations(results)


def trainer_steps(results: Results) -> None:
    """Time steps of the studio's trainer, and compare its gradients with autograd's."""
    import wgpu

    from wgsl_trainer import NETWORKS, measure

    adapter = wgpu.gpu.request_adapter_sync(power_preference="high-performance")
    results.set("trainer_adapter", adapter.summary)
    device = adapter.request_device_sync()
    for name in list(NETWORKS)[:1] + list(NETWORKS)[-1:] if REHEARSAL else NETWORKS:
        results.add("steps", measure(device, name, 2 if REHEARSAL else 200))


def evaluations(results: Results) -> None:
    """Evaluate the WGSL function of spot by WebGPU on Vulkan: its difference from numpy, and points per second."""
    import numpy as np
    from wgpu.utils.compute import compute_with_buffers  # type: ignore[import-untyped]

    import mplicits

    field, count, turns = mplicits.load("spot"), 4096 if REHEARSAL else 1 << 20, 4 if REHEARSAL else 64
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (count, 4)).astype(np.float32)
    main = """
@group(0) @binding(0) var<storage, read> points: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> found: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) at: vec3u) {
    let i = at.x + at.y * 65536u; var sum = spot(points[i].xyz);
    for (var k = 1u; k < TURNS; k++) { sum += 1e-30 * spot(points[i].xyz + 1e-4 * f32(k)); }
    found[i] = sum;
}"""
    text = field.bake("wgsl", name="spot")
    groups = (min(count, 65536) // 64, -(-count // 65536), 1)
    for loops in (1, turns):
        shader = text + main.replace("TURNS", f"{loops}u")
        for _ in range(2):
            began = time.perf_counter()
            out = compute_with_buffers({0: points}, {1: (count, "f")}, shader, n=groups)
            results.set(f"seconds_{loops}", time.perf_counter() - began)
        if loops == 1:
            values = np.frombuffer(out[1], np.float32)
            results.set("largest_difference", float(np.abs(values[:4096] - field.sdf(points[:4096, :3])).max()))
    results.set("evaluations", {"1": count, str(turns): count * turns})
