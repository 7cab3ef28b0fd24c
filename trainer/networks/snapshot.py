"""The state of a training, as a file can store it."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import torch
from torch import Tensor

from ...model.errors import UserError


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A state that an object can continue from: named JSON values and tensors."""

    numbers: dict[str, Any] = field(default_factory=dict)
    tensors: dict[str, Tensor] = field(default_factory=dict)

    def __or__(self, other: "Snapshot") -> "Snapshot":
        """Join two snapshots with different names."""
        return Snapshot(self.numbers | other.numbers, self.tensors | other.tensors)

    def inside(self, name: str) -> "Snapshot":
        """Prefix every name with `name` and a dot, so that snapshots of several objects can be joined."""
        numbers = {f"{name}.{key}": value for key, value in self.numbers.items()}
        return Snapshot(numbers, {f"{name}.{key}": tensor for key, tensor in self.tensors.items()})

    def of(self, name: str) -> "Snapshot":
        """Return the part with the prefix `name`, without it."""
        start = f"{name}."
        numbers = {key.removeprefix(start): value for key, value in self.numbers.items() if key.startswith(start)}
        tensors = {key.removeprefix(start): tensor for key, tensor in self.tensors.items() if key.startswith(start)}
        return Snapshot(numbers, tensors)

    def whole(self, name: str) -> int:
        """Return an integer from 0 that a float can say. Raises UserError if it is missing."""
        number = self.numbers.get(name)
        if type(number) is not int or not 0 <= number < 2**53:
            raise UserError(f"training: '{name}' is not a whole number")
        return number

    def real(self, name: str) -> float:
        """Return a number. Raises UserError if it is missing."""
        number = self.numbers.get(name)
        if not isinstance(number, int | float) or not abs(number) < 1e300:
            raise UserError(f"training: '{name}' is not a number")
        return float(number)

    def tensor(self, name: str, like: Tensor) -> Tensor:
        """Return a tensor with the shape, type and device of `like`. Raises UserError if it is missing."""
        tensor = self.tensors.get(name)
        if tensor is None or tensor.shape != like.shape or tensor.dtype != like.dtype:
            raise UserError(f"training.{name}: missing, or of another shape or type")
        return tensor.to(like.device)

    def rows(self, name: str, columns: int) -> Tensor:
        """Return a float32 tensor (N, columns) of any N. Raises UserError where there is none by that name."""
        tensor = self.tensors.get(name, torch.empty(0))
        return self.tensor(name, tensor.new_empty((len(tensor) if tensor.ndim else 0, columns), dtype=torch.float32))


class Resumable(Protocol):
    """An object with a state."""

    def snapshot(self) -> Snapshot:
        """Return the state."""

    def restore(self, snapshot: Snapshot) -> None:
        """Continue from a state. Raises UserError if it belongs to something else."""


def random_state(generator: torch.Generator) -> Snapshot:
    """Return the state of a random number generator."""
    return Snapshot(tensors={"generator": generator.get_state()})


def set_random_state(generator: torch.Generator, snapshot: Snapshot) -> None:
    """Set a random number generator to a state of `random_state`. Raises UserError for anything else."""
    state = snapshot.tensor("generator", generator.get_state())
    try:
        generator.set_state(state)
    except RuntimeError:
        raise UserError("training.generator: not the state of a random number generator") from None
