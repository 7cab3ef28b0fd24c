"""Evaluates a model's nested field (interpret.nested_levels) at many points, in chunks, on all cores.

The values are those of interpret.py, up to rounding, from networks without padding. Chunks keep a layer's values in the
cache of a core, and the memory beyond the results does not grow with the number of points.
"""

import contextlib
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from ..ir.lower import lower
from ..ir.program import Array
from ..model.errors import UserError
from ..model.files import show_value
from ..model.model import Model, Network
from ..model.value_types import fits
from . import interpret

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

Input = TypeVar("Input", bound=np.generic)
Output = TypeVar("Output", bound=np.generic)

Floats = NDArray[np.floating]
CACHED = 2**17
"""Number of values of one layer that stay in a core's cache."""


class Evaluator:
    """Evaluates one model. Thread-safe."""

    def __init__(self, model: Model) -> None:
        self._scene = None if model.scene is None else lower(model)
        self._networks = [_joined(level.network) for level in model.levels]
        self._texture = None if model.texture is None else _joined(model.texture)
        self._deltas = [level.delta for level in model.levels]
        self._moving = model.inputs == "xyzt"
        widest = max(len(layer.bias) for network in model.networks().values() for layer in network)
        self._chunk = max(CACHED // (widest + 1), 256)

    def value(self, points: Floats, level: int | None = None, time: float = 0.0) -> Array:
        """Evaluate the nested field up to `level`, None for the last, at points (N, 3), model space.

        time: the fourth input of a moving model. Returns (N,) float32, model units, negative inside. Raises UserError
        if the model has no such level.
        """
        level = self.checked(level)
        return self.over(points, lambda part: self.nested(part, level, time)[0], (), np.float32)

    def nested(self, points: Floats, level: int, time: float = 0.0) -> tuple[Array, NDArray[np.int64]]:
        """Return the value (N,) and its level (N,) at all points, in this thread."""
        if self._scene is not None:
            return interpret.nested_field(self._scene, points.astype(np.float32), level, time)
        inputs, networks = self._inputs(points, time), self._networks[:level]
        total = _value(networks[0], inputs)[0]
        reached = np.ones(len(points), np.int64)
        defined, f = np.arange(len(points)), total
        for number, (network, delta) in enumerate(zip(networks[1:], self._deltas, strict=False), start=2):
            inside = np.flatnonzero(np.abs(f) < delta)
            defined = defined[inside]
            f = f[inside] + _value(network, inputs[:, defined])[0]
            total[defined], reached[defined] = f, number
        return total, reached

    def gradient(self, points: Floats, level: int | None = None, time: float = 0.0) -> Array:
        """Evaluate the gradient of `value` along x, y and z: (N, 3) float32. Arguments as for `value`."""
        last, scene = self.checked(level), self._scene
        networks = self._networks[:last]

        def work(points: Floats) -> Array:
            if scene is not None:
                return interpret.field_gradient(scene, points.astype(np.float32), last, time)[0]
            inputs = self._inputs(points, time)
            f, total = _value_and_gradient(networks[0], inputs)
            defined = np.arange(len(points))
            for network, delta in zip(networks[1:], self._deltas, strict=False):
                inside = np.flatnonzero(np.abs(f) < delta)
                defined = defined[inside]
                residual, gradient = _value_and_gradient(network, inputs[:, defined])
                f = f[inside] + residual
                total[:, defined] += gradient
            return total[:3].T

        return self.over(points, work, (3,), np.float32)

    def color(self, points: Floats, time: float = 0.0) -> Array | None:
        """Evaluate the color at points (N, 3): (N, 3) float32, sRGB in [0, 1]; None without a texture."""
        texture, scene = self._texture, self._scene
        if scene is not None:
            return self.over(
                points.astype(np.float32), lambda part: interpret.color(scene, part, time), (3,), np.float32
            )
        if texture is None:
            return None
        return self.over(
            points, lambda points: np.clip(_value(texture, self._inputs(points, time)), 0, 1).T, (3,), np.float32
        )

    def checked(self, level: int | None) -> int:
        """Return the number of a level, of the last for None. Raises UserError if the model has no such level."""
        levels = len(self._networks)
        number: object = getattr(level, "tolist", lambda: level)()
        if number is not None and not (fits(number, int) and 1 <= cast(int, number) <= levels):
            raise UserError(f"level {show_value(level)}: the model has levels 1 to {levels}")
        return levels if number is None else cast(int, number)

    def _inputs(self, points: Floats, time: float) -> Array:
        """Return the networks' inputs at points (N, 3): x, y, z, the time of a moving model, and 1; (4 or 5, N)."""
        inputs = np.ones((5 if self._moving else 4, len(points)), np.float32)
        inputs[:3] = points.T
        if self._moving:
            inputs[3] = time
        return inputs

    def over(
        self,
        rows: NDArray[Input],
        work: Callable[[NDArray[Input]], NDArray[Output]],
        columns: tuple[int, ...],
        dtype: type[Output],
    ) -> NDArray[Output]:
        """Call `work` for chunks of rows (N, ...), in one thread per core. Returns (N, *columns)."""
        results = np.empty((len(rows), *columns), dtype)

        def compute(start: int) -> None:
            results[start : start + self._chunk] = work(rows[start : start + self._chunk])

        starts = range(0, len(rows), self._chunk)
        if len(starts) < 2:
            for start in starts:
                compute(start)
            return results
        # Where BLAS keeps its own threads, one thread here: more would compete with them for the cores.
        with _blas_in_one_thread as single, ThreadPoolExecutor(_cores() if single else 1) as pool:
            list(pool.map(compute, starts))
        return results


Joined = list[Array]
"""Weight and bias of each layer in one matrix (out, in + 1), for inputs that end in 1."""


def _joined(network: Network) -> Joined:
    return [np.column_stack((layer.weight, layer.bias)) for layer in network]


class _Layers(threading.local):
    """Memory for the values of layers, one per thread, reused for each chunk.

    The system maps new memory page by page, which would take longer than the computation.
    """

    def __init__(self) -> None:
        self._blocks: dict[int, Array] = {}

    def get(self, number: int, rows: int, columns: int) -> Array:
        """Return an uninitialized array (rows, columns), in the memory of the last array of that number."""
        size = rows * columns
        if size > CACHED:
            return np.empty((rows, columns), np.float32)
        if number not in self._blocks:
            self._blocks[number] = np.empty(CACHED, np.float32)
        return self._blocks[number][:size].reshape(rows, columns)


_layers = _Layers()


def _layer(number: int, matrix: Array, inputs: Array) -> tuple[Array, Array]:
    """Compute the angles of a layer, before its sine, in the block `number` of this thread's memory.

    inputs: (in + 1, N). Returns the angles (out, N), and the block (out + 1, N), whose last row is ones.
    """
    rows, columns = len(matrix), inputs.shape[1]
    block = _layers.get(number, rows + 1, columns)
    block[-1] = 1
    return np.matmul(matrix, inputs, out=block[:-1]), block


def _value(network: Joined, inputs: Array) -> Array:
    """Evaluate a network (Eq. 2) at inputs (4 or 5, N). Returns (outputs, N)."""
    for index, matrix in enumerate(network[:-1]):
        angles, inputs = _layer(index % 2, matrix, inputs)
        np.sin(angles, out=angles)
    output: Array = network[-1] @ inputs
    return output


def _value_and_gradient(network: Joined, inputs: Array) -> tuple[Array, Array]:
    """Evaluate a network with one output, (N,), and its gradient by the adjoint pass, (3 or 4, N)."""
    cosines = []
    for index, matrix in enumerate(network[:-1]):
        angles, inputs = _layer(index % 2, matrix, inputs)
        cosines.append(np.cos(angles, out=_layers.get(2 + index, *angles.shape)))
        np.sin(angles, out=angles)
    value: Array = (network[-1] @ inputs)[0]
    adjoint = network[-1][:, :-1].T
    for matrix, cosine in zip(network[-2::-1], reversed(cosines), strict=True):
        adjoint = matrix[:, :-1].T @ np.multiply(cosine, adjoint, out=cosine)
    return value, adjoint


def _cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _libraries() -> "ThreadpoolController":
    """Find NumPy's BLAS, once: the search takes as long as thousands of points."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


class _SingleThreadedBlas:
    """Limits BLAS to one thread while any thread is inside `with`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._restore: Callable[[], None] | None = None

    def __enter__(self) -> bool:
        """Return False if BLAS cannot be limited: without threadpoolctl, a dependency of the extra `mesh`.

        The command line limits it from the start (__main__.py).
        """
        limited = os.environ.get("OPENBLAS_NUM_THREADS") == "1"
        with self._lock:
            self._inside += 1
            if self._inside == 1 and not limited:
                with contextlib.suppress(ModuleNotFoundError):
                    self._restore = _libraries().limit(limits=1, user_api="blas").restore_original_limits
            return limited or self._restore is not None

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0 and self._restore is not None:
                self._restore()
                self._restore = None


_blas_in_one_thread = _SingleThreadedBlas()
