"""A function of points is evaluated at many points, on all cores."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits


class Progress(Protocol):
    """Somebody who is told how far long work is."""

    def begin(self, stage: str, total: int) -> None:
        """Take note that a stage of `total` points begins, and that the one before is over."""
        ...

    def advance(self, points: int) -> None:
        """Take note that so many more points are done."""
        ...


class Silent:
    """A `Progress` that tells nobody."""

    def begin(self, stage: str, total: int) -> None:
        """Do nothing."""

    def advance(self, points: int) -> None:
        """Do nothing."""


def over(
    points: NDArray[Any], function: Callable[[NDArray[Any]], tuple[NDArray[Any], ...]], progress: Progress, chunk: int
) -> tuple[NDArray[Any], ...]:
    """Evaluate a function at points, chunk by chunk, in as many threads as there are cores.

    points: (N, ...). function: takes (M, ...) of them and returns arrays, of as many rows or of others. chunk: the
    largest M. progress is told as chunks are done. Returns the function's arrays, joined in the points' order.
    """
    parts = [points[start : start + chunk] for start in range(0, max(len(points), 1), chunk)]

    def work(part: NDArray[Any]) -> tuple[NDArray[Any], ...]:
        arrays = function(part)
        progress.advance(len(part))
        return arrays

    # NumPy releases the interpreter's lock, so one thread for each core is enough; BLAS must not start more of its own.
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(work, parts))
    return tuple(np.concatenate(arrays) for arrays in zip(*results, strict=True))
