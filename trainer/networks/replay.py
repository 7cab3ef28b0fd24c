"""CUDA graphs: kernels that are recorded once, and then launched together.

The kernels of a training step take a few microseconds each, less than their launches from Python.
"""

from collections.abc import Callable
from typing import TypeVar

import torch
from torch import Tensor

from .network import Weights

WARM_UP = 3
"""Calls before the recording, in which libraries load their kernels; these calls are steps, too."""

Result = TypeVar("Result")


def records(device: torch.device) -> bool:
    """Whether kernels of a device can be recorded."""
    return device.type == "cuda"


class Replay:
    """Calls a function of weights and of more arguments; on a CUDA device, records its kernels and replays them.

    The kernels read the weights, and write them or their .grad, at the addresses of the recording. They read other
    tensors from copies in buffers. Other arguments are constants of the kernels. The recording is made anew when
    anything of this changes but the values of tensors. The function must not read values of tensors on the CPU, and
    its other tensors must stay where they are.
    """

    def __init__(self) -> None:
        self._key: tuple[object, ...] = ()
        self._calls = 0  # Calls with this key, before the recording.
        self._launch: Callable[[], None] | None = None
        self._buffers: list[Tensor] = []
        self._result: object = None
        self.failure = ""
        """Why the kernels cannot be recorded: then every call runs the function."""

    def __call__(self, function: Callable[..., Result], weights: Weights, *arguments: object) -> Result:
        """Return function(weights, *arguments). The next call may overwrite the tensors of the result.

        function: always the same one.
        """
        if self.failure or not records(weights[0].device):
            return function(weights, *arguments)
        key = (*map(_address, weights), *(a.shape if isinstance(a, Tensor) else a for a in arguments))
        if key != self._key:
            self._key, self._calls = key, 0
            self._launch, self._buffers, self._result = None, [], None  # This frees the memory of the recording.
        tensors = [a for a in arguments if isinstance(a, Tensor)]
        if self._launch is None:
            self._calls += 1
            if self._calls <= WARM_UP:
                return function(weights, *arguments)
            self._buffers = [tensor.clone() for tensor in tensors]
            buffers = iter(self._buffers)
            fixed = [next(buffers) if isinstance(a, Tensor) else a for a in arguments]
            try:
                self._launch, self._result = record(lambda: function(weights, *fixed))
            except RuntimeError as error:
                self.failure = str(error)
                return function(weights, *arguments)
        torch._foreach_copy_(self._buffers, tensors)
        self._launch()
        return self._result  # type: ignore[return-value]


def record(function: Callable[[], Result]) -> tuple[Callable[[], None], Result]:
    """Record the kernels of a function, which do not run. Returns what runs them, and the result that this fills.

    Raises RuntimeError where the function does what cannot be recorded, such as waiting for the device.
    """
    graph = torch.cuda.CUDAGraph()
    with (
        torch.cuda.stream(torch.cuda.current_stream()),  # After an error, the recording leaves its own stream current.
        torch.cuda.graph(graph, capture_error_mode="thread_local"),
    ):
        result = function()
    return graph.replay, result


def _address(weight: Tensor) -> tuple[int, int, torch.Size]:
    """Return where a weight and its .grad are in memory, and their shape."""
    return weight.data_ptr(), 0 if weight.grad is None else weight.grad.data_ptr(), weight.shape
