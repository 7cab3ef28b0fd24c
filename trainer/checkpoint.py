"""The checkpoint of a training: a model file with the state of the training, from which `--resume` continues."""

import contextlib
import json
import time
from collections.abc import Callable
from pathlib import Path

from safetensors import SafetensorError, safe_open

from ..model.checks import check_json
from ..model.errors import UserError
from ..model.files import is_special, show
from ..model.gallery import PART, SUFFIX
from ..model.model import Model
from ..model.model_file import TRAINING, load, save
from .config import default_config
from .networks.snapshot import Snapshot


class CheckpointFile:
    """The checkpoint `NAME.part.safetensors` beside the output `NAME.safetensors`, until the training ends.

    Every verb opens it as a model. The state of the training is in further tensors and in one more metadata key. Where
    the output is a device or a pipe, no checkpoint is written.
    """

    def __init__(self, output: Path, say: Callable[[str], None], every: float | None = None) -> None:
        """say: receives a warning where the file cannot be written; the training continues.

        every: seconds between two checkpoints; None: the default. Raises UserError where `output` has the name of
        another training's checkpoint.
        """
        if output.name.endswith(PART + SUFFIX):
            raise UserError(f"cannot write {show(output)}: that is the name of a checkpoint; name another with -o")
        self.path = output.with_name(f"{output.name.removesuffix(SUFFIX)}{PART}{SUFFIX}")
        self._every = default_config().budget.checkpoint_every if every is None else every
        self._say, self._next = say, time.perf_counter() + self._every
        self._writes, self._warned = not is_special(output), False

    def is_there(self) -> bool:
        """Whether an interrupted training has left a checkpoint.

        Raises UserError where another file has that name, which a checkpoint would overwrite.
        """
        if not self._writes or not self.path.exists():
            return False
        with contextlib.suppress(OSError, SafetensorError), safe_open(self.path, framework="pt") as file:
            if TRAINING in (file.metadata() or {}):
                return True
        raise UserError(f"{show(self.path)}: not the checkpoint of a training; move it away, or name another -o")

    def read(self) -> tuple[Model, Snapshot]:
        """Read the model and the state of the training. Raises UserError where the file is damaged."""
        model = load(self.path)
        try:
            with safe_open(self.path, framework="pt") as file:
                numbers = json.loads((file.metadata() or {})[TRAINING])
                check_json("training", {"numbers": numbers})
                names = [name for name in file.keys() if name.startswith(f"{TRAINING}.")]  # noqa: SIM118
                tensors = {name.removeprefix(f"{TRAINING}."): file.get_tensor(name) for name in names}
        except (OSError, SafetensorError, ValueError, KeyError, RecursionError, UserError):
            numbers = None
        if not isinstance(numbers, dict):
            raise UserError(f"{show(self.path)}: damaged; remove it, and train again")
        return model, Snapshot(numbers, tensors)

    def due(self) -> bool:
        """Whether it is time for the next checkpoint."""
        return self._writes and time.perf_counter() >= self._next

    def write(self, model: Model, snapshot: Snapshot) -> None:
        """Write the file atomically."""
        if not self._writes:
            return
        try:
            tensors = {name: tensor.cpu().numpy() for name, tensor in snapshot.tensors.items()}
            save(model, self.path, (json.dumps(snapshot.numbers), tensors))
        except UserError as error:
            if not self._warned:
                self._say(f"warning: {error}; until it can be written, an interrupted training is lost")
            self._warned = True
        self._next = time.perf_counter() + self._every

    def remove(self) -> None:
        """Remove the file at the end of the training."""
        with contextlib.suppress(OSError):
            if self._writes:
                self.path.unlink(missing_ok=True)
