"""A function of points over many points, on all cores."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits


class Progress(Protocol):
    """Is told of long work."""

    def begin(self, stage: str, total: int) -> None:
        """A stage of `total` points begins, and the one before is over."""
        ...

    def advance(self, points: int) -> None:
        """So many more points are done."""
        ...


class Silent:
    """Nobody is told."""

    def begin(self, stage: str, total: int) -> None:
        """Says nothing."""

    def advance(self, points: int) -> None:
        """Says nothing."""


def over(
    points: NDArray[Any], function: Callable[[NDArray[Any]], tuple[NDArray[Any], ...]], progress: Progress, chunk: int
) -> tuple[NDArray[Any], ...]:
    """What `function` makes of points (N, ...), in the points' order; it is called on at most `chunk` at a time."""
    parts = [points[start : start + chunk] for start in range(0, max(len(points), 1), chunk)]

    def work(part: NDArray[Any]) -> tuple[NDArray[Any], ...]:
        found = function(part)
        progress.advance(len(part))
        return found

    # NumPy lets go of the interpreter's lock: one thread a core, and none of BLAS's own beside them.
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(work, parts))
    return tuple(np.concatenate(columns) for columns in zip(*found, strict=True))
