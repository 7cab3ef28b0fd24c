"""Evaluation of a function of points on all cores, in chunks."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits


class Progress(Protocol):
    """Receives the progress of long work."""

    def begin(self, stage: str, total: int) -> None:
        """A stage of `total` points begins; the previous stage ends."""
        ...

    def advance(self, points: int) -> None:
        """`points` more points are done."""
        ...


class Silent:
    """A `Progress` that shows nothing."""

    def begin(self, stage: str, total: int) -> None:
        """Do nothing."""

    def advance(self, points: int) -> None:
        """Do nothing."""


def over(
    points: NDArray[Any], function: Callable[[NDArray[Any]], tuple[NDArray[Any], ...]], progress: Progress, chunk: int
) -> tuple[NDArray[Any], ...]:
    """Evaluate a function at points, in chunks, with one thread per core.

    points: (N, ...). function: from (M, ...) to arrays with any number of rows. chunk: largest M. Returns the arrays of
    all chunks, concatenated in order.
    """
    parts = [points[start : start + chunk] for start in range(0, max(len(points), 1), chunk)]

    def work(part: NDArray[Any]) -> tuple[NDArray[Any], ...]:
        arrays = function(part)
        progress.advance(len(part))
        return arrays

    # NumPy releases the interpreter's lock: one thread per core suffices, and BLAS must not start more.
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(work, parts))
    return tuple(np.concatenate(arrays) for arrays in zip(*results, strict=True))
