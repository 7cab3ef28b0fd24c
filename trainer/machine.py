"""Settings of the C library and of PyTorch that make steps on a CPU faster without changing what they compute."""

import contextlib
import ctypes

import torch

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Of glibc's malloc.h."""
MOST_THREADS = 8
"""A step's operations are too small for more."""


def prepare(device: torch.device) -> None:
    """Call once before training on `device` and before other threads use PyTorch. A GPU needs none of it.

    glibc gives large blocks back to the system at every free, and each new one costs page faults: keep them. PyTorch's
    "medium" precision sends float32 products to oneDNN, which on processors without bfloat16 matrix units is often
    faster than the default library at the same precision; it is kept only where it loses none.
    """
    if device.type != "cpu":
        return
    torch.set_num_threads(min(torch.get_num_threads(), MOST_THREADS))
    with contextlib.suppress(OSError, AttributeError):
        libc = ctypes.CDLL("libc.so.6")
        libc.mallopt(M_MMAP_THRESHOLD, 1 << 30)
        libc.mallopt(M_TRIM_THRESHOLD, 1 << 30)
    torch.set_float32_matmul_precision("medium")
    if not products_are_exact():
        torch.set_float32_matmul_precision("highest")


def products_are_exact() -> bool:
    """Whether a float32 product has float32's error (bfloat16's is 2^16 times larger)."""
    generator = torch.Generator().manual_seed(0)
    a, b = (torch.rand(256, 64, generator=generator) for _ in range(2))
    error = (a @ b.t()).double() - a.double() @ b.double().t()
    return float(error.abs().max()) < 1e-4
