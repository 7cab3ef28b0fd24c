"""What is open in a window, and the work that is due: drawing, reloading, training, exporting. Knows no window."""

import time
from collections.abc import Callable
from pathlib import Path

from ...model.errors import UserError
from ...model.files import show
from ...model.mesh_file import SUFFIXES as SURFACES
from ..draw.compile import ShaderError
from ..draw.context import Context
from ..draw.renderer import Renderer
from .jobs import Cost, Job
from .overlay import SHOWN, MeshFile, Overlay
from .picture import Picture
from .source import Source, Watch, open_source
from .training import Training
from .view import View

REST = 0.15
"""Seconds without a move after which every pixel is drawn."""
SPELL = 1 / 30
"""Seconds of work between two looks at what the user does."""
LOOK = 0.4
"""Seconds between looks at a watched file."""
STAYS = 8.0
"""Seconds that a message stays."""


class Desk:
    """source, renderer: of the model that is shown. overlay: of a mesh beside it.
    message, log: for the user; log: of a shader that does not compile.
    stale: what is on the screen is no longer what is to be shown.

    wake: ends a wait for events, from any thread. Raises what `Renderer` raises.
    """

    def __init__(
        self,
        context: Context,
        source: Source,
        view: View,
        *,
        storage: str = "auto",
        watch: bool = False,
        mesh: MeshFile | None = None,
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        self.context, self.source, self.view = context, source, view
        self._storage, self._wake, self._watching = storage, wake, watch
        self.renderer = Renderer(context, source.shader)
        self.renderer.schedule(view.options)
        self.picture = Picture(context)
        self.overlay = None if mesh is None else Overlay(context, mesh, storage)
        self._watch = Watch(source.path) if watch else None
        self.message, self.log, self.costs = "", list[str](), list[Cost]()
        self.job: Job | None = None
        self._draws, self._refined, self._mesh_shown = False, True, view.mesh
        self._trained: Path | None = None
        self.doing = (0.0, "")
        self.training: Training | None = None
        self.stale, self.timing = True, ""
        self._pending: tuple[Path, bool] | None = None
        self._until = self._look = self._rest = 0.0
        self._last, self._spent = time.perf_counter(), 0.0

    @property
    def resting(self) -> bool:
        """Nothing is left to draw, to load or to write."""
        busy = self.view.changed or self.picture.refining or not self._refined
        return not (busy or self.job or self.training or self._pending)

    @property
    def progress(self) -> str:
        """Of the training, else of the job."""
        if self.training is not None:
            return f"{self.training.name}: {self.training.stage} {self.training.fraction:.0%}"
        return f"{self.doing[1]} {self.doing[0]:.0%}" if self.job is not None else ""

    def say(self, message: str) -> None:
        """A line for the user."""
        self.message, self._until, self.stale = message, time.perf_counter() + STAYS, True

    def open(self, path: Path) -> None:
        """Shows another file, soon: compiling takes seconds, and the window says so first."""
        self._pending, self.log = (path, False), []
        self.say(f"opening {show(path.name)}")

    def train(self, paths: list[Path], more: tuple[str, ...] = ()) -> None:
        """Trains a shape in the background, or imports the checkpoints of a model."""
        self.stop_training()
        self.training = Training(paths, self._wake, more)
        self._trained, self.stale = paths[0], True

    def stop_training(self) -> None:
        """Ends a training; the model that is shown stays."""
        if self.training is not None:
            self.training.stop()
            self.training, self.stale = None, True

    def begin(self, job: Job, draws: bool = False) -> None:
        """Starts a job; another one that runs is dropped. draws: with `drawn` or `renderer`, until its share is 1."""
        self.cancel()
        self.job, self._draws, self.doing = job, draws, (0.0, "")

    def cancel(self, drawing: bool = False) -> None:
        """Ends the job. drawing: only one that draws, for what it draws with changes."""
        if self.job is not None and ((self._draws and self.doing[0] < 1.0) or not drawing):
            self.job.close()
            self.job, self.stale = None, True

    def tick(self, area: tuple[int, int]) -> float | None:
        """Does what is due for a picture of `area` pixels; returns the seconds until more is, None: nothing is."""
        now = time.perf_counter()
        waits = [self._files(now), self._train(), self._work(), self._draw(area, now)]
        self._last = now
        if self.message:
            if now >= self._until and self._pending is None:
                self.message, self.stale = "", True
            waits.append(max(0.0, self._until - now))
        return min((wait for wait in waits if wait is not None), default=None)

    def close(self) -> None:
        """Ends what runs and frees what is held in the context, which stays."""
        self.cancel()
        self.stop_training()
        self.picture.release()
        if self.overlay is not None:
            self.overlay.release()
        self.renderer.release()

    @property
    def drawn(self) -> Renderer:
        """What draws the picture: `renderer`, or the overlay's."""
        if self.overlay is None:
            return self.renderer
        if self.view.mesh != self._mesh_shown:
            self._mesh_shown = self.view.mesh
            self.cancel(drawing=True)
        try:
            return self.overlay.over(self.renderer, self.source, self.view.mesh)
        except UserError as error:
            self.view.mesh = SHOWN[0]
            self._refuse(error, str(error))
            return self.renderer

    def _refuse(self, error: UserError, shader: str) -> None:
        """Says why something is not shown; of a shader that does not compile says `shader` and keeps the log."""
        self.say(shader if isinstance(error, ShaderError) else str(error))
        self.log = error.log if isinstance(error, ShaderError) else self.log

    def _files(self, now: float) -> float | None:
        if self._pending is not None:
            path, announced = self._pending
            if not announced:  # The message is drawn first.
                self._pending = path, True
                return 0.0
            self._pending, self.message = None, ""
            self._load(path)
        if self._watch is None:
            return None
        if now >= self._look:
            self._look = now + LOOK
            if self._watch.changed():
                self._load(self._watch.path)
        return self._look - now

    def _load(self, path: Path) -> None:
        if self._watching and (self._watch is None or path != self._watch.path):
            self._watch = Watch(path)
        self._show(path)

    def _show(self, path: Path) -> None:
        try:
            source = open_source(path, self._storage)
            renderer = Renderer(self.context, source.shader)
            try:
                renderer.schedule(self.view.fitting(source.shader.levels, source.textured))
            except UserError:
                renderer.release()
                raise
        except UserError as error:
            self._refuse(error, f"{show(path.name)}: the shader does not compile; the last good picture stays")
            return
        self.cancel(drawing=True)
        self.renderer.release()
        self.renderer, self.source, self.log, self.costs, self.stale = renderer, source, [], [], True
        self.view.adopt(source.shader.levels, source.textured)

    def _train(self) -> float | None:
        if self.training is None:
            return None
        self._follow()
        self.stale = True
        if self.training.running:
            return LOOK
        outcome = self.training.outcome()
        self._follow()
        self.say(outcome)
        self.stop_training()
        return 0.0

    def _follow(self) -> None:
        """Shows what the training has written since the last call; its shape is then the mesh beside it."""
        assert self.training is not None
        if not self.training.news():
            return
        if self._trained is not None:
            if self.overlay is not None:
                self.overlay.release()
            mesh = self._trained.suffix.lower() in SURFACES
            self.overlay = Overlay(self.context, MeshFile(self._trained), self._storage) if mesh else None
            self.renderer.edges, self.view.mesh, self._trained, self._watch = None, SHOWN[0], None, None
        self._show(self.training.model)

    def _work(self) -> float | None:
        if self.job is None:
            return None
        try:
            before, self.doing = self.doing, next(self.job)
            self.stale |= before != self.doing
        except StopIteration as end:
            self.job = None
            self.say(end.value)
        except UserError as error:
            self.job = None
            self.say(str(error))
        return 0.01

    def _draw(self, area: tuple[int, int], now: float) -> float | None:
        view = self.view
        if view.turntable:
            view.spin(min(0.25, now - self._last))
        scene = view.scene(area)
        if view.changed:
            moved, view.changed, view.moved = view.moved, False, False
            self.picture.sketch(self.drawn, scene, view.scale)
            seconds = time.perf_counter() - now
            width, height = scene.size
            self._time(seconds, (round(width / view.scale), round(height / view.scale)))
            self._refined = view.scale == 1.0 and view.options.samples == 1 and view.resolution == 1.0
            view.timed(seconds)
            self._rest, self._spent, self.stale = now + seconds + (REST if moved else 0.0), 0.0, True
        elif self.picture.refining:
            self.picture.more(SPELL)
            self._spent += time.perf_counter() - now
            self.stale = True
            if not self.picture.refining:
                self._time(self._spent / view.options.samples, scene.size)
        elif not self._refined and now >= self._rest:
            self.picture.refine(self.drawn, scene)
            self._refined = True
        if view.turntable or self.picture.refining:
            return 0.0
        return None if self._refined else max(0.0, self._rest - time.perf_counter())

    def _time(self, seconds: float, size: tuple[int, int]) -> None:
        self.timing = f"{size[0]}x{size[1]} in {1000 * seconds:.1f} ms"
