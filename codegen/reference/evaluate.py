"""A model's field at many points: level after level where each is defined (Eq. 3), in chunks, on all cores.

It gives what interpret.py does, up to rounding, for the same networks without padding; chunks keep a layer's values in
a core's cache, and what it takes of memory beyond its results does not grow with the number of points.
"""

import contextlib
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UserError
from ...model.model import Model, Network
from ..ir.lower import lower
from ..ir.program import Array
from . import interpret

Input = TypeVar("Input", bound=np.generic)
Output = TypeVar("Output", bound=np.generic)

CACHED = 2**17
"""How many values of one layer stay in a core's cache."""


class Evaluator:
    """Evaluates one model; several threads may use it at once."""

    def __init__(self, model: Model) -> None:
        self._scene = None if model.scene is None else lower(model)
        self._networks = [_transposed(level.network) for level in model.levels]
        self._texture = None if model.texture is None else _transposed(model.texture)
        self._deltas = [level.delta for level in model.levels]
        self._moving = model.inputs == "xyzt"
        widest = max(len(layer.bias) for network in model.networks().values() for layer in network)
        self._chunk = max(CACHED // widest, 256)

    def value(self, points: Array, level: int | None = None, time: float = 0.0) -> Array:
        """Evaluate the finest level that is defined at each point, up to `level`; None: up to the last.

        points: (N, 3) float32, model space. time: the fourth input of a model that moves. Returns (N,) float32, model
        units, negative inside. Raises UserError where the model has no such level.
        """
        level = self.checked(level)
        return self.over(points, lambda part: self.nested(part, level, time)[0], (), np.float32)

    def nested(self, points: Array, level: int, time: float = 0.0) -> tuple[Array, NDArray[np.int64]]:
        """Evaluate as `value` does, and say which level answers: (N,) and (N,); all points at once, in this thread."""
        if self._scene is not None:
            return interpret.nested_field(self._scene, points, level, time)
        inputs, networks = self._inputs(points, time), self._networks[:level]
        total = _value(networks[0], inputs)[:, 0]
        reached = np.ones(len(points), np.int64)
        defined, f = np.arange(len(points)), total
        for number, (network, delta) in enumerate(zip(networks[1:], self._deltas, strict=False), start=2):
            inside = np.flatnonzero(np.abs(f) < delta)
            defined = defined[inside]
            f = f[inside] + _value(network, inputs[defined])[:, 0]
            total[defined], reached[defined] = f, number
        return total, reached

    def gradient(self, points: Array, level: int | None = None, time: float = 0.0) -> Array:
        """Evaluate the gradient along x, y and z of what `value` gives: (N, 3) float32. Takes what `value` takes."""
        last, scene = self.checked(level), self._scene
        networks = self._networks[:last]

        def work(points: Array) -> Array:
            if scene is not None:
                return interpret.field_gradient(scene, points, last, time)[0]
            inputs = self._inputs(points, time)
            f, total = _value_and_gradient(networks[0], inputs)
            defined = np.arange(len(points))
            for network, delta in zip(networks[1:], self._deltas, strict=False):
                inside = np.flatnonzero(np.abs(f) < delta)
                defined = defined[inside]
                residual, gradient = _value_and_gradient(network, inputs[defined])
                f = f[inside] + residual
                total[defined] += gradient
            return total[:, :3]

        return self.over(points, work, (3,), np.float32)

    def colour(self, points: Array, time: float = 0.0) -> Array | None:
        """Evaluate the colour at points (N, 3): (N, 3) float32, sRGB in [0, 1]; None where there is no texture."""
        texture, scene = self._texture, self._scene
        if scene is not None:
            return self.over(points, lambda part: interpret.colour(scene, part, time), (3,), np.float32)
        if texture is None:
            return None
        return self.over(
            points, lambda points: np.clip(_value(texture, self._inputs(points, time)), 0, 1), (3,), np.float32
        )

    def checked(self, level: int | None) -> int:
        """Return a level's number, the last one's for None. Raises UserError where the model has no such level."""
        levels = len(self._networks)
        if level is not None and not 1 <= level <= levels:
            raise UserError(f"level {level}: the model has levels 1 to {levels}")
        return levels if level is None else level

    def _inputs(self, points: Array, time: float) -> Array:
        if not self._moving:
            return points
        return np.concatenate([points, np.full((len(points), 1), time, np.float32)], axis=1)

    def over(
        self,
        rows: NDArray[Input],
        work: Callable[[NDArray[Input]], NDArray[Output]],
        columns: tuple[int, ...],
        dtype: type[Output],
    ) -> NDArray[Output]:
        """Do some work on chunks of rows (N, ...), in as many threads as there are cores. Returns (N, *columns)."""
        results = np.empty((len(rows), *columns), dtype)

        def one(start: int) -> None:
            results[start : start + self._chunk] = work(rows[start : start + self._chunk])

        starts = range(0, len(rows), self._chunk)
        if len(starts) < 2:
            for start in starts:
                one(start)
            return results
        with _blas_in_one_thread as alone:
            if not alone:  # BLAS has threads of its own; more of ours would fight with them for the cores.
                for start in starts:
                    one(start)
                return results
            with ThreadPoolExecutor(_cores()) as pool:
                for _ in pool.map(one, starts):
                    pass
        return results


Transposed = list[tuple[Array, Array]]
"""Weight (in, out) and bias (out,) of each layer."""


def _transposed(network: Network) -> Transposed:
    return [(np.ascontiguousarray(layer.weight.T), layer.bias) for layer in network]


def _value(network: Transposed, inputs: Array) -> Array:
    """Evaluate a network (Eq. 2) at inputs (N, 3 or 4). Returns (N, outputs)."""
    hidden = inputs
    for weight, bias in network[:-1]:
        hidden = hidden @ weight
        hidden += bias
        np.sin(hidden, out=hidden)
    weight, bias = network[-1]
    output: Array = hidden @ weight
    output += bias
    return output


def _value_and_gradient(network: Transposed, inputs: Array) -> tuple[Array, Array]:
    """Evaluate a network with one output, (N,), and its gradient by the adjoint pass, (N, 3 or 4)."""
    hidden, cosines = inputs, []
    for weight, bias in network[:-1]:
        angle = hidden @ weight
        angle += bias
        cosines.append(np.cos(angle))
        hidden = np.sin(angle, out=angle)
    weight, bias = network[-1]
    value: Array = (hidden @ weight)[:, 0] + bias[0]
    adjoint = weight.T
    for (weight, _), cosine in zip(network[-2::-1], reversed(cosines), strict=True):
        adjoint = np.multiply(cosine, adjoint, out=cosine) @ weight.T
    return value, adjoint


def _cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _SingleThreadedBlas:
    """Keeps BLAS from starting threads while anybody is inside `with`; they may be several, in several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._restore: Callable[[], None] | None = None

    def __enter__(self) -> bool:
        """Return False where nothing can be told BLAS: without threadpoolctl, which the extra `mesh` brings."""
        with self._lock:
            self._inside += 1
            if self._inside == 1:
                with contextlib.suppress(ModuleNotFoundError):
                    from threadpoolctl import threadpool_limits

                    self._restore = threadpool_limits(1, "blas").restore_original_limits
            return self._restore is not None

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0 and self._restore is not None:
                self._restore()
                self._restore = None


_blas_in_one_thread = _SingleThreadedBlas()
