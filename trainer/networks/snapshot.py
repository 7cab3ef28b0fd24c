"""The state of a training that is under way, as a file can hold it."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import torch
from torch import Tensor

from ...model.errors import UserError


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All that something needs to go on as if it had never stopped: JSON values and tensors, each by a name."""

    numbers: dict[str, Any] = field(default_factory=dict)
    tensors: dict[str, Tensor] = field(default_factory=dict)

    def __or__(self, other: "Snapshot") -> "Snapshot":
        """Join two snapshots, whose names differ."""
        return Snapshot(self.numbers | other.numbers, self.tensors | other.tensors)

    def inside(self, name: str) -> "Snapshot":
        """Put `name` and a dot before every name, so that snapshots of several things can be joined."""
        numbers = {f"{name}.{key}": value for key, value in self.numbers.items()}
        return Snapshot(numbers, {f"{name}.{key}": tensor for key, tensor in self.tensors.items()})

    def of(self, name: str) -> "Snapshot":
        """Take out what `inside` has put under `name`."""
        start = f"{name}."
        numbers = {key.removeprefix(start): value for key, value in self.numbers.items() if key.startswith(start)}
        tensors = {key.removeprefix(start): tensor for key, tensor in self.tensors.items() if key.startswith(start)}
        return Snapshot(numbers, tensors)

    def whole(self, name: str) -> int:
        """Return a whole number from 0. Raises UserError where there is none by that name."""
        number = self.numbers.get(name)
        if type(number) is not int or number < 0:
            raise UserError(f"training: '{name}' is not a whole number")
        return number

    def real(self, name: str) -> float:
        """Return a number. Raises UserError where there is none by that name."""
        number = self.numbers.get(name)
        if not isinstance(number, int | float) or not abs(number) < 1e300:
            raise UserError(f"training: '{name}' is not a number")
        return float(number)

    def tensor(self, name: str, like: Tensor) -> Tensor:
        """Return a tensor. Raises UserError where there is none by that name with the shape and type of `like`."""
        tensor = self.tensors.get(name)
        if tensor is None or tensor.shape != like.shape or tensor.dtype != like.dtype:
            raise UserError(f"training.{name}: missing, or of another shape or type")
        return tensor.to(like.device)


class Resumable(Protocol):
    """Something whose state can be kept, and set to what was kept."""

    def snapshot(self) -> Snapshot:
        """Return the state as it is now."""

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a state. Raises UserError where it is no state of this thing."""


def random_state(generator: torch.Generator) -> Snapshot:
    """Return the state of a generator of random numbers."""
    return Snapshot(tensors={"generator": generator.get_state()})


def set_random_state(generator: torch.Generator, snapshot: Snapshot) -> None:
    """Set a generator of random numbers to a state of `random_state`. Raises UserError where it is none."""
    state = snapshot.tensor("generator", generator.get_state())
    try:
        generator.set_state(state)
    except RuntimeError:
        raise UserError("training.generator: not the state of a generator of random numbers") from None
