"""All that a window shows and does, without the window: the picture, the files behind it, the work beside it."""

import time
from collections.abc import Callable
from pathlib import Path

from ...model.errors import UserError
from ...model.files import show
from ...model.mesh_file import SUFFIXES as MESH_SUFFIXES
from ..draw.compile import ShaderError
from ..draw.context import Context
from ..draw.renderer import Renderer
from .drawing import Drawing
from .files import WATCH_INTERVAL, Files
from .overlay import MeshSource
from .shown import Shown
from .source import Source
from .training_process import TrainingProcess
from .view import View
from .work import Work

MESSAGE_SECONDS = 8.0
"""Seconds that a message stays."""
JOB_INTERVAL = 0.01
"""Seconds, at most, between two bits of a job."""


class Desk:
    """Owns what is shown, its drawing, its files and the work; `tick` moves them on and passes results between them."""

    def __init__(
        self,
        context: Context,
        source: Source,
        view: View,
        *,
        storage: str = "auto",
        watch: bool = False,
        mesh: MeshSource | None = None,
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        """Show `source` as `view` has it. The context stays the caller's.

        storage: how shaders hold the weights of models. watch: load the file again when it changes.
        mesh: laid over the model. wake: ends a wait for events; it may be called from any thread.
        Raises UserError if the driver refuses the shader, or its loop limit what `view` asks for.
        """
        self.shown = Shown(context, source, view, storage, mesh)
        self.drawing = Drawing(context)
        self.files = Files(source.path, watch)
        self.work = Work(wake)
        self.message = ""
        """A line for the user."""
        self._message_end = 0.0
        self.log = list[str]()
        """What the driver says of a shader that does not compile, line by line."""
        self.stale = True
        """Whether the screen has to be painted again; the window resets it."""

    @property
    def resting(self) -> bool:
        """Whether nothing is left to draw, to load, to write or to train."""
        work, pending = self.work, self.files.pending
        return self.drawing.resting and not (self.shown.view.changed or work.job or work.training or pending)

    def say(self, message: str) -> None:
        """Show a line to the user for MESSAGE_SECONDS."""
        self.message, self._message_end, self.stale = message, time.perf_counter() + MESSAGE_SECONDS, True

    def open(self, path: Path) -> None:
        """Show another model or shader file, soon: compiling takes seconds, and the user is told first."""
        self.files.open(path)
        self.log = []
        self.say(f"opening {show(path.name)}")

    def drawn_by(self) -> Renderer:
        """Return what draws the picture; the user is told of a mesh that cannot be shown, and it is left out."""
        if self.shown.mesh_mode_changed:
            self.work.cancel_drawing()
        try:
            return self.shown.drawn_by()
        except UserError as error:
            self._refuse(error, str(error))
            return self.shown.renderer

    def tick(self, area: tuple[int, int]) -> float | None:
        """Do what is due for a picture of `area` (width, height) pixels.

        Returns the seconds until the next call is due, None if only an event makes one due.
        """
        now = time.perf_counter()
        waits = [
            self._tick_files(now),
            self._tick_training(),
            self._tick_job(),
            self.drawing.tick(self.shown.view, area, self.drawn_by, now),
        ]
        self.stale |= self.work.changed or self.drawing.changed
        self.work.changed = self.drawing.changed = False
        if self.message:
            if now >= self._message_end and self.files.pending is None:
                self.message, self.stale = "", True
            waits.append(max(0.0, self._message_end - now))
        return min((wait for wait in waits if wait is not None), default=None)

    def close(self) -> None:
        """End the work and free what is held in the context."""
        self.work.cancel()
        self.work.stop_training()
        self.drawing.release()
        self.shown.release()

    def _tick_files(self, now: float) -> float | None:
        opening = self.files.pending is not None
        path, wait = self.files.tick(now)
        if path is not None:
            if opening:
                self.message = ""
            self._load(path)
        return wait

    def _load(self, path: Path) -> None:
        """Show a model or shader file, or say why it is not shown."""
        try:
            source, renderer = self.shown.compiled(path)
        except UserError as error:
            self._refuse(error, f"{show(path.name)}: the shader does not compile; the last good picture stays")
            return
        self.work.cancel_drawing()
        self.shown.adopt(source, renderer)
        self.log, self.stale = [], True

    def _refuse(self, error: UserError, shader_message: str) -> None:
        """Say why something is not shown: `shader_message`, and the driver's log, if a shader does not compile."""
        if isinstance(error, ShaderError):
            self.say(shader_message)
            self.log = error.log
        else:
            self.say(str(error))

    def _tick_training(self) -> float | None:
        training = self.work.training
        if training is None:
            return None
        self.stale = True
        self._show_training(training)
        if training.running:
            return WATCH_INTERVAL
        outcome = training.outcome()
        self._show_training(training)
        self.say(outcome)
        self.work.stop_training()
        return 0.0

    def _show_training(self, training: TrainingProcess) -> None:
        """Show the model that the training has written since the last call, with the mesh that it trains on."""
        if not training.has_new_model():
            return
        if training.versions == 1:
            is_mesh = training.shape.suffix.lower() in MESH_SUFFIXES
            self.work.cancel_drawing()
            self.shown.lay_over(MeshSource(training.shape) if is_mesh else None)
            self.files.unwatch()
        self._load(training.model)

    def _tick_job(self) -> float | None:
        if self.work.job is None:
            return None
        if (outcome := self.work.advance()) is not None:
            self.say(outcome)
        return JOB_INTERVAL
