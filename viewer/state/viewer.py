"""Everything that a window shows and does, without the window: the model, its picture and files, background work."""

import time
from collections.abc import Callable
from pathlib import Path

from ...model.endings import MESHES
from ...model.errors import UserError
from ...model.files import show
from ..draw.compile import ShaderError
from ..draw.context import Context
from ..draw.options import RenderOptions
from ..draw.renderer import Renderer
from .drawing import Drawing
from .files import WATCH_INTERVAL, Files
from .jobs import LevelTiming
from .overlay import MESH_MODES, MeshSource, Overlay
from .source import Source, open_source
from .training_process import TrainingProcess
from .view import View
from .work import Work

MESSAGE_SECONDS = 8.0
"""Seconds for which a message stays."""
JOB_INTERVAL = 0.01
"""Largest time between two steps of a job, seconds."""


class Viewer:
    """The model on the screen, its view, picture and files, and background work; `tick` advances all of them."""

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
        """Compile the shader of `source`. The caller keeps the context.

        storage: of the weights in shaders. watch: reload the file when it changes. mesh: to lay over the model. wake:
        ends a wait for events, from any thread. Raises UserError if the driver rejects the shader, or if its loop limit
        is too small for the view.
        """
        self.context, self.source, self.view, self._storage = context, source, view, storage
        self.renderer = self._renderer_for(source, view.options)
        self.overlay = None if mesh is None else Overlay(context, mesh, storage)
        self.level_timings = list[LevelTiming]()
        """Cost of each level of this model, once measured."""
        self.drawing, self.files, self.work = Drawing(context), Files(source.path, watch), Work(wake)
        self.message, self._message_end = "", 0.0
        self.log = list[str]()
        """The driver's complaints about a shader."""
        self.stale = True
        """Whether the screen needs a repaint; the window resets it."""

    @property
    def idle(self) -> bool:
        """Whether nothing is left to draw, load, write or train."""
        work, pending = self.work, self.files.pending
        return self.drawing.complete and not (self.view.changed or work.job or work.training or pending)

    def say(self, message: str) -> None:
        """Show a line to the user for MESSAGE_SECONDS."""
        self.message, self._message_end, self.stale = message, time.perf_counter() + MESSAGE_SECONDS, True

    def open(self, path: Path) -> None:
        """Announce a model or shader file, and show it soon: compiling takes seconds."""
        self.files.open(path)
        self.log = []
        self.say(f"opening {show(path.name)}")

    def current_renderer(self) -> Renderer:
        """Return what draws the picture: `renderer` or a rasterizer of the mesh. A mesh that fails is hidden."""
        if self.overlay is None:
            return self.renderer
        if self.overlay.mode != self.view.mesh:
            self.work.cancel_drawing()
        try:
            return self.overlay.renderer_for(self.renderer, self.source, self.view.mesh)
        except UserError as error:
            self.view.mesh = MESH_MODES[0]
            self._report(error, str(error))
            return self.renderer

    def tick(self, area: tuple[int, int]) -> float | None:
        """Draw, load and work for a picture of `area` (width, height) pixels.

        Returns the seconds until the next call is due; None: only an event makes one due.
        """
        now = time.perf_counter()
        waits = [
            self._tick_files(now),
            self._tick_training(),
            self._tick_job(),
            self.drawing.tick(self.view, area, self.current_renderer, now),
        ]
        self.stale |= self.work.changed or self.drawing.changed
        self.work.changed = self.drawing.changed = False
        if self.message:
            if now >= self._message_end and self.files.pending is None:
                self.message, self.stale = "", True
            waits.append(max(0.0, self._message_end - now))
        return min((wait for wait in waits if wait is not None), default=None)

    def close(self) -> None:
        """End the work, and free everything in the context."""
        self.work.cancel()
        self.work.stop_training()
        for resource in (self.drawing, self.overlay, self.renderer):
            if resource is not None:
                resource.release()

    def _renderer_for(self, source: Source, options: RenderOptions) -> Renderer:
        """Compile the shader of a source. Raises UserError if the driver rejects it or the schedule of the options."""
        renderer = Renderer(self.context, source.shader, options.shade)
        try:
            renderer.schedule(options)
        except UserError:
            renderer.release()
            raise
        return renderer

    def _tick_files(self, now: float) -> float | None:
        opening = self.files.pending is not None
        path, wait = self.files.tick(now)
        if path is not None:
            if opening:
                self.message = ""
            self._load(path)
        return wait

    def _load(self, path: Path) -> None:
        """Show a model or shader file, or report why it cannot be shown."""
        try:
            source = open_source(path, self._storage)
            renderer = self._renderer_for(source, self.view.fitting(source.shader.levels, source.textured))
        except UserError as error:
            self._report(error, f"{show(path.name)}: the shader does not compile; the last good picture stays")
            return
        self.work.cancel_drawing()
        self.renderer.release()
        new_front = source.front if source.path != self.source.path else None
        self.renderer, self.source, self.level_timings = renderer, source, []
        self.view.adapt(source.shader.levels, source.textured, source.shader.moving)
        if new_front is not None:
            self.view.look_from(new_front)
        self.log, self.stale = [], True

    def _report(self, error: UserError, shader_message: str) -> None:
        """Show an error; for a shader that does not compile, `shader_message` and the driver's log."""
        self.say(shader_message if isinstance(error, ShaderError) else str(error))
        if isinstance(error, ShaderError):
            self.log = error.log

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
        """Show the training's newest model, with the mesh of the training laid over it, hidden at first."""
        if not training.has_new_model():
            return
        if training.versions == 1:
            self.work.cancel_drawing()
            if self.overlay is not None:
                self.overlay.release()
            mesh = MeshSource(training.shape) if training.shape.suffix.lower() in MESHES else None
            self.overlay = None if mesh is None else Overlay(self.context, mesh, self._storage)
            self.renderer.edges, self.view.mesh = None, MESH_MODES[0]
            self.files.unwatch()
        self._load(training.model)

    def _tick_job(self) -> float | None:
        if self.work.job is None:
            return None
        if (outcome := self.work.advance()) is not None:
            self.say(outcome)
        return JOB_INTERVAL
