"""One step's batch in parts on several threads, each part on one.

Products of this size gain little from threads inside each operation, and wait at every one of them while another
program has a core; parts of a batch wait once a step. Parts are summed in their own order, so that results do not
depend on timing.
"""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import torch
from torch import Tensor

from .network import Weights

MOST = 8
Part = TypeVar("Part")


def cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Workers:
    """Threads for the parts of a step: one a core, `MOST` at most; none where `device` is a GPU."""

    def __init__(self, device: torch.device) -> None:
        self.threads = min(cores(), MOST) if device.type == "cpu" else 1
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def backward(self, weights: Weights, loss: Callable[[Part], Tensor], parts: Iterable[Part]) -> float:
        """Sets the weights' .grad to the gradient of the sum of `loss(part)`; returns that sum."""

        def one(part: Part) -> tuple[float, tuple[Tensor, ...]]:
            value = loss(part)
            return value.item(), torch.autograd.grad(value, weights)

        done = list(self._pool.map(one, parts) if self._pool else map(one, parts))
        for k, weight in enumerate(weights):
            weight.grad = done[0][1][k].contiguous()
            for _, gradients in done[1:]:
                weight.grad += gradients[k]
        return sum(value for value, _ in done)
