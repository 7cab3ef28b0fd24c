"""The device of the training, and settings that make steps on a CPU faster with the same results."""

import contextlib
import ctypes

import torch

from ..model.errors import UserError

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Parameters of mallopt in glibc's malloc.h."""
BLOCK = 1 << 30
"""Largest freed block that glibc keeps, bytes."""
MOST_THREADS = 8
"""Most threads: the operations of a step are too small for more."""


def device(name: str) -> torch.device:
    """Return the device called "auto", "cpu" or "cuda". Raises UserError where there is no CUDA device."""
    if name == "cuda" and not torch.cuda.is_available():
        raise UserError("--device cuda: this PyTorch finds no CUDA device; use --device cpu")
    return torch.device("cuda" if name == "cuda" or (name == "auto" and torch.cuda.is_available()) else "cpu")


def prepare(device: torch.device) -> None:
    """Set up PyTorch and the C library for training on `device`; a GPU needs nothing.

    Call it once, before training and before other threads use PyTorch. glibc returns large blocks to the system at
    every free, and each new one costs page faults, so mallopt makes it keep them. PyTorch's "medium" precision computes
    float32 products with oneDNN, which is often faster at the same precision on processors without bfloat16 matrix
    units; where it would lose precision it is switched off again.
    """
    if device.type != "cpu":
        return
    torch.set_num_threads(min(torch.get_num_threads(), MOST_THREADS))
    with contextlib.suppress(OSError, AttributeError):
        libc = ctypes.CDLL("libc.so.6")
        libc.mallopt(M_MMAP_THRESHOLD, BLOCK)
        libc.mallopt(M_TRIM_THRESHOLD, BLOCK)
    torch.set_float32_matmul_precision("medium")
    if not products_are_exact():
        torch.set_float32_matmul_precision("highest")


def products_are_exact() -> bool:
    """Whether float32 products have float32's error; in bfloat16 it would be 2^16 times as large."""
    generator = torch.Generator().manual_seed(0)
    a, b = (torch.rand(256, 64, generator=generator) for _ in range(2))
    error = (a @ b.t()).double() - a.double() @ b.double().t()
    return float(error.abs().max()) < 1e-4
