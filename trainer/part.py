"""The file beside an output from which a training that was cut short goes on: a model file that holds more."""

import contextlib
import json
import time
from collections.abc import Callable
from pathlib import Path

from safetensors import SafetensorError, safe_open

from ..model.errors import UserError
from ..model.files import is_special, show
from ..model.gallery import SUFFIX
from ..model.model import Model
from ..model.model_file import TRAINING, load, save
from .networks.snapshot import Snapshot

EVERY = 30.0
"""Seconds between two writings of the file: the most that is lost."""


class Part:
    """`NAME.part.safetensors`, beside the output `NAME.safetensors` of a training that is not over.

    It is a model of what is learnt so far, which every verb opens, with the state of the training in further tensors
    and in one more metadata key. Where the output is a device or a pipe, there is none, and nothing is written.
    """

    def __init__(self, output: Path, say: Callable[[str], None]) -> None:
        """say: receives a warning where the file cannot be written, after which the training goes on."""
        self.path = output.with_name(f"{output.name.removesuffix(SUFFIX)}.part{SUFFIX}")
        self._say, self._next = say, time.perf_counter() + EVERY
        self._writes, self._warned = not is_special(output), False

    def is_there(self) -> bool:
        """Whether a training that was cut short has left the file.

        Raises UserError where a file of that name is there that is something else, and would be lost.
        """
        if not self._writes or not self.path.exists():
            return False
        with contextlib.suppress(OSError, SafetensorError), safe_open(self.path, framework="pt") as file:
            if TRAINING in (file.metadata() or {}):
                return True
        raise UserError(f"{show(self.path)}: is there, and no training that was cut short; move it away, or name -o")

    def read(self) -> tuple[Model, Snapshot]:
        """Read the model, and the state of the training. Raises UserError where the file is damaged."""
        model = load(self.path)
        try:
            with safe_open(self.path, framework="pt") as file:
                numbers = json.loads((file.metadata() or {})[TRAINING])
                names = [name for name in file.keys() if name.startswith(f"{TRAINING}.")]  # noqa: SIM118
                tensors = {name.removeprefix(f"{TRAINING}."): file.get_tensor(name) for name in names}
        except (OSError, SafetensorError, ValueError, KeyError, RecursionError):
            numbers = None
        if not isinstance(numbers, dict):
            raise UserError(f"{show(self.path)}: damaged; remove it, and train anew")
        return model, Snapshot(numbers, tensors)

    def due(self) -> bool:
        """Whether it is time to write the file."""
        return self._writes and time.perf_counter() >= self._next

    def write(self, model: Model, snapshot: Snapshot) -> None:
        """Write the file, whole or not at all."""
        if not self._writes:
            return
        try:
            tensors = {name: tensor.cpu().numpy() for name, tensor in snapshot.tensors.items()}
            save(model, self.path, (json.dumps(snapshot.numbers), tensors))
        except UserError as error:
            if not self._warned:
                self._say(f"warning: {error}; until it can be written, a training that is cut short is lost")
            self._warned = True
        self._next = time.perf_counter() + EVERY

    def remove(self) -> None:
        """Remove the file: the training is over."""
        with contextlib.suppress(OSError):
            if self._writes:
                self.path.unlink(missing_ok=True)
