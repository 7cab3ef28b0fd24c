"""When the picture is drawn: coarsely at once while something changes, every pixel and all samples at rest."""

import time
from collections.abc import Callable

from ..draw.context import Context
from ..draw.renderer import Renderer
from .picture import Picture
from .view import View

REFINE_DELAY = 0.15
"""Seconds without a move of the camera after which every pixel is drawn."""
WORK_SLICE = 1 / 30
"""Seconds of drawing between two looks at what the user does."""
LONGEST_SPIN = 0.25
"""Seconds, at most, by which the turntable or a motion goes on at once."""


class Drawing:
    """Brings the picture up to date with the view, a bit at every tick."""

    def __init__(self, context: Context) -> None:
        self.picture = Picture(context)
        self.timing = ""
        """How many pixels were drawn last, and in how long: a line for the user."""
        self.changed = False
        """Whether the picture has been drawn on since the owner last reset this."""
        self._complete = True
        """Whether the refinement of the picture has begun, or the coarse picture needs none."""
        self._refine_time = 0.0
        """When the refinement is to begin."""
        self._last_tick = time.perf_counter()

    @property
    def resting(self) -> bool:
        """Whether the picture is drawn with every pixel and all samples."""
        return self._complete and not self.picture.refining

    def tick(self, view: View, area: tuple[int, int], drawn_by: Callable[[], Renderer], now: float) -> float | None:
        """Draw what is due; return the seconds until the next call is due, None if only an event makes one due.

        area: (width, height) of the picture on the screen, in pixels. drawn_by: gives what draws it.
        now: seconds on the clock of time.perf_counter.
        """
        passed = min(LONGEST_SPIN, now - self._last_tick)
        if view.turntable:
            view.spin(passed)
        if view.playing:
            view.play(passed)
        self._last_tick = now
        scene = view.scene(area)
        if view.changed:
            moved, view.changed, view.moved = view.moved, False, False
            self.picture.sketch(drawn_by(), scene, view.scale)
            seconds = time.perf_counter() - now
            width, height = scene.size
            self._tell(seconds, (round(width / view.scale), round(height / view.scale)))
            self._complete = view.scale == 1.0 and view.options.samples == 1 and view.resolution == 1.0
            view.timed(seconds)
            self._refine_time = now + seconds + (REFINE_DELAY if moved else 0.0)
            self.changed = True
        elif self.picture.refining:
            self.picture.more(WORK_SLICE)
            self.changed = True
            if not self.picture.refining:
                self._tell(self.picture.frame_seconds, scene.size)
        elif not self._complete and now >= self._refine_time:
            self.picture.refine(drawn_by(), scene)
            self._complete = True
        if view.animated or self.picture.refining:
            return 0.0
        return None if self._complete else max(0.0, self._refine_time - time.perf_counter())

    def release(self) -> None:
        self.picture.release()

    def _tell(self, seconds: float, size: tuple[int, int]) -> None:
        took = f"{1000 * seconds:.1f} ms" if seconds < 1.0 else f"{seconds:.1f} s"
        self.timing = f"{size[0]}x{size[1]} in {took}"
