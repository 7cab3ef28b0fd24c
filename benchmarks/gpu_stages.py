"""The stages of on_gpu.py: each is a function that runs in a process of its own and records what it finds."""

import sys
import time
from collections.abc import Callable
from functools import partial

from gpu_commands import DEVICE, REHEARSAL, run
from gpu_cuda import check, counters, sanitizer, table2
from gpu_glsl import glsl
from gpu_learning import train
from gpu_page import page
from gpu_wgsl import wgsl
from stages import Results


def machine(results: Results) -> None:
    """Describe the machine: the card, its drivers, tools and libraries, and the speed of a float32 product."""
    commands = {
        "gpu": "nvidia-smi --query-gpu=name,driver_version,memory.total,power.limit,clocks.max.sm --format=csv,noheader"
        " || echo none",
        "nvcc": "nvcc --version | tail -2",
        "tools": "which nvcc ncu nsys compute-sanitizer cuobjdump nvidia-smi chromium Xvfb",
        "processor": "grep -m1 'model name' /proc/cpuinfo; nproc; uname -r; free -g | head -2",
        "loaders": "ldconfig -p | grep -E 'libEGL|libGLX|libvulkan|libcublas.so|libnvidia-egl|libnvidia-gl'",
        "manifests": "find /usr /etc -name '*nvidia*.json' -path '*[ev]*' 2>/dev/null | head -20",
        "environment": "env | grep -E '^(LD_LIBRARY_PATH|__EGL|VK_|PYTHONPATH|MPLICITS)'",
        "packages": f"{sys.executable} -m pip list 2>/dev/null | grep -iE '^(torch|numpy|scipy|pillow|moderngl|wgpu) '",
    }
    for name, command in commands.items():
        results.set(name, run("sh", "-c", command).stdout.strip())
    import torch

    from protocol import machine as software

    results.set("software", software())
    side = 512 if REHEARSAL else 8192
    a = torch.rand(side, side, device=DEVICE)
    seconds = []
    for _ in range(5):
        began = time.perf_counter()
        float((a @ a)[0, 0])
        seconds.append(time.perf_counter() - began)
    results.set("float32_tflops", round(2 * side**3 / min(seconds) / 1e12, 2))


STAGES: dict[str, tuple[float, Callable[[Results], None]]] = {
    "machine": (40, machine),
    "check": (110, check),
    "table2": (150, table2),
    "glsl": (90, glsl),
    "sanitizer": (60, sanitizer),
    "armadillo": (150, partial(train, "armadillo")),
    "counters": (120, counters),
    "wgsl": (60, wgsl),
    "page": (150, page),
    "lucy": (145, partial(train, "lucy", beside=False)),
}
"""Name of a stage -> time limit in seconds, function; the most valuable stage first."""
