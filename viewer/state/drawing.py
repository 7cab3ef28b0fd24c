"""When the picture is drawn: coarsely while something moves, all pixels and samples at rest."""

import time
from collections.abc import Callable

from ..draw.context import Context
from ..draw.renderer import Renderer
from .picture import Picture
from .view import View

REFINE_DELAY = 0.15
"""Seconds after the last move of the camera until every pixel is drawn."""
WORK_SLICE = 1 / 30
"""Seconds of drawing between two polls of events."""
LONGEST_STEP = 0.25
"""Largest step of the turntable or a motion, seconds."""


class Drawing:
    """Draws the view, a part of the work at every tick."""

    def __init__(self, context: Context) -> None:
        self.picture = Picture(context)
        self.timing = ""
        """The number of pixels of the last drawing and its time, for the user."""
        self.changed = False
        """Whether the picture has changed; the owner resets it."""
        self._refined = True
        """Whether the refinement has begun, or the coarse picture needs none."""
        self._refine_time = 0.0
        self._last_tick = time.perf_counter()

    @property
    def complete(self) -> bool:
        """Whether every pixel and all samples are drawn."""
        return self._refined and not self.picture.refining

    def tick(
        self, view: View, area: tuple[int, int], current_renderer: Callable[[], Renderer], now: float
    ) -> float | None:
        """Draw the next tiles. Return the seconds until the next call; None: wait for an event.

        area: (width, height) of the picture on the screen, pixels. now: time.perf_counter().
        """
        passed = min(LONGEST_STEP, now - self._last_tick)
        if view.turntable:
            view.spin(passed)
        if view.playing:
            view.play(passed)
        self._last_tick = now
        scene = view.scene(area)
        if view.changed:
            moved, view.changed, view.moved = view.moved, False, False
            self.picture.sketch(current_renderer(), scene, view.scale)
            seconds = time.perf_counter() - now
            width, height = scene.size
            self._set_timing(seconds, (round(width / view.scale), round(height / view.scale)))
            self._refined = view.scale == 1.0 and view.options.samples == 1 and view.resolution == 1.0
            view.timed(seconds)
            self._refine_time = now + seconds + (REFINE_DELAY if moved else 0.0)
            self.changed = True
        elif self.picture.refining:
            self.picture.more(WORK_SLICE)
            self.changed = True
            if not self.picture.refining:
                self._set_timing(self.picture.frame_seconds, scene.size)
        elif not self._refined and now >= self._refine_time:
            self.picture.refine(current_renderer(), scene)
            self._refined = True
        if view.animated or self.picture.refining:
            return 0.0
        return None if self._refined else max(0.0, self._refine_time - time.perf_counter())

    def release(self) -> None:
        self.picture.release()

    def _set_timing(self, seconds: float, size: tuple[int, int]) -> None:
        time_text = f"{1000 * seconds:.1f} ms" if seconds < 1.0 else f"{seconds:.1f} s"
        self.timing = f"{size[0]}x{size[1]} in {time_text}"
