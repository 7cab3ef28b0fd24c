"""The desktop window of `mplicits view`: GLFW's events on their way to the desk, and its picture on the screen."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...model.errors import UserError
from ..draw.camera import Camera
from ..draw.context import open_window
from ..draw.options import RenderOptions
from ..state.desk import Desk
from ..state.jobs import Turntable, free_path, picture
from ..state.overlay import MeshFile
from ..state.picture import Scene
from ..state.source import open_source
from ..state.view import TURNS, View, keys
from .drop import drop
from .gui import Gui, open_gui

SAVED_SAMPLES = 4
"""Rays per pixel of a saved picture, at least."""
PATIENCE = 1.0
"""Seconds between two looks at Ctrl-C, which GLFW's wait does not notice."""
RATE = 60
"""Pictures per second of a display that does not say."""


class Window:
    """A visible GLFW window with a desk, and a panel where imgui-bundle is installed.

    size: of the window, as the system counts it. Raises UserError where there is no display or no such file, and what
    `Renderer` raises.
    """

    def __init__(
        self,
        path: Path,
        camera: Camera,
        options: RenderOptions,
        size: tuple[int, int],
        *,
        storage: str = "auto",
        watch: bool = False,
        mesh: MeshFile | None = None,
    ) -> None:
        import glfw

        source = open_source(path, storage)
        view = View(camera, options, source.shader.levels, source.textured)
        options.traced(view.levels)
        options.check_texture(source.textured)
        self.context = open_window(size, f"{source.name}   compiling", visible=True)
        self.handle = self.context.handle
        self._pointer, self._title, self._said = (0.0, 0.0), "", ""
        try:
            self.desk = Desk(
                self.context, source, view, storage=storage, watch=watch, mesh=mesh, wake=glfw.post_empty_event
            )
        except UserError:
            self.context.release()
            raise
        self.gui: Gui | None = open_gui(self.context)
        view.panel = self.gui is not None and self.gui.roomy()
        self._frame = 1 / _refresh_rate()
        with self.context:
            glfw.swap_interval(1)
        self._listen()
        self._fit()

    @property
    def area(self) -> tuple[int, int, int, int]:
        """(x, y from the bottom, width, height) of the picture, framebuffer pixels: what the panel leaves free."""
        import glfw

        width, height = (max(1, side) for side in glfw.get_framebuffer_size(self.handle))
        panel = self.gui.panel_width(self.desk) if self.gui is not None else 0
        return panel, 0, width - panel, height

    def loop(self) -> None:
        """Until closed. Sleeps while nothing happens; draws only what has changed."""
        import glfw

        while not glfw.window_should_close(self.handle):
            start = time.perf_counter()
            due = self.step()
            if self.desk.view.turntable and due == 0.0:  # where drivers do not wait for the display
                due = max(0.0, 0.9 * self._frame - (time.perf_counter() - start))
            try:
                if due == 0.0:
                    glfw.poll_events()
                else:
                    glfw.wait_events_timeout(PATIENCE if due is None else min(due, PATIENCE))
            except UnicodeDecodeError:
                self.desk.say("a file whose name is not UTF-8; rename it")

    def step(self) -> float | None:
        """One turn of the loop; returns the seconds until the next is due, None: when an event comes."""
        due = self.desk.tick(self.area[2:])
        if self.desk.stale or (self.gui is not None and self.gui.restless):
            self.paint()
        self._tell()
        return 0.0 if self.gui is not None and self.gui.restless else due

    def paint(self, swap: bool = True) -> None:
        """The picture as far as it is drawn, and the panel over it, onto the screen."""
        import glfw

        self.desk.stale = False
        with self.context as gl:
            if self.gui is not None:
                self.gui.build(self)
            x, y, width, height = self.area
            gl.screen.use()
            self.desk.picture.show((x, y), (width, height), self.desk.view.split is not None)
            if self.gui is not None:
                self.gui.draw()
            if swap:
                glfw.swap_buffers(self.handle)

    def save(self, size: tuple[int, int] | None = None) -> None:
        """Writes the picture as a PNG, of the size that is shown or another, into the working folder."""
        desk, view = self.desk, self.desk.view
        size = size or self.area[2:]
        options = replace(view.options, samples=max(SAVED_SAMPLES, view.options.samples))
        camera, name = replace(view.camera, aspect=size[0] / size[1]), desk.source.name
        right = None if view.right is None else replace(view.right, samples=options.samples)
        desk.begin(picture(desk.drawn, free_path(name, ".png"), Scene(size, camera, options, right), name), draws=True)

    def record(self, video: Turntable) -> None:
        """Writes a video of one turn into the working folder."""
        desk = self.desk
        scene = desk.view.scene(self.area[2:])
        desk.begin(video.job(desk.drawn, free_path(desk.source.name, ".mp4"), scene), draws=True)

    def close(self) -> None:
        """Ends what runs and frees the window."""
        self.desk.close()
        if self.gui is not None:
            self.gui.release()
        self.context.release()

    def key(self, name: str) -> None:
        """A key that was pressed, by its name."""
        import glfw

        if name == "ESCAPE":
            glfw.set_window_should_close(self.handle, True)
        elif name == "S":
            self.save()
        else:
            self.desk.view.key(name)
            if name == "TAB":
                self._fit()
            if name == "H" and self.gui is None:
                print(keys(), flush=True)
        self.desk.stale = True

    def _fit(self) -> None:
        self.desk.view.resize(self.area[2:])

    def _tell(self) -> None:
        """The title; without a panel, messages on the terminal."""
        import glfw

        desk = self.desk
        title = "   ".join(part for part in (desk.source.name, desk.timing, desk.progress) if part)
        if title != self._title:
            self._title = title
            glfw.set_window_title(self.handle, title)
        if self.gui is None and desk.message != self._said:
            self._said = desk.message
            print(*[line for line in (desk.message, *desk.log) if line], sep="\n", flush=True)

    def _listen(self) -> None:
        import glfw

        def resized(*_: Any) -> None:
            self._fit()
            self._wake()

        def refreshed(*_: Any) -> None:  # some systems call nothing else while a window is being resized
            self.desk.stale = True
            self.step()

        glfw.set_cursor_pos_callback(self.handle, self._on_cursor)
        glfw.set_mouse_button_callback(self.handle, self._on_button)
        glfw.set_scroll_callback(self.handle, self._on_scroll)
        glfw.set_key_callback(self.handle, self._on_key)
        glfw.set_char_callback(self.handle, self._on_char)
        listen_drop: Any = glfw.set_drop_callback  # which is annotated as GLFW calls it, not as it calls back
        listen_drop(self.handle, self._on_drop)
        glfw.set_window_refresh_callback(self.handle, refreshed)
        glfw.set_framebuffer_size_callback(self.handle, resized)
        glfw.set_window_content_scale_callback(self.handle, resized)

    def _wake(self) -> None:
        if self.gui is not None:
            self.gui.stir()

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        import glfw

        height = max(1, glfw.get_window_size(window)[1])
        right, up = (x - self._pointer[0]) / height, (self._pointer[1] - y) / height
        self._pointer = (x, y)
        if self.gui is not None and self.gui.moved(x, y):
            return
        held = [
            glfw.get_mouse_button(window, button) == glfw.PRESS
            for button in (glfw.MOUSE_BUTTON_LEFT, glfw.MOUSE_BUTTON_RIGHT, glfw.MOUSE_BUTTON_MIDDLE)
        ]
        shift = glfw.PRESS in (glfw.get_key(window, key) for key in (glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT))
        if held[1] or held[2] or (held[0] and shift):
            self.desk.view.pan(right, up)
        elif held[0]:
            self.desk.view.turn(right, up)

    def _on_button(self, _window: Any, button: int, action: int, _mods: int) -> None:
        import glfw

        if self.gui is not None:
            self.gui.pressed(button, action == glfw.PRESS)

    def _on_scroll(self, _window: Any, x: float, y: float) -> None:
        if self.gui is None or not self.gui.scrolled(x, y):
            self.desk.view.zoom(y)

    def _on_key(self, _window: Any, code: int, _scan: int, action: int, mods: int) -> None:
        import glfw

        if self.gui is not None and self.gui.key(code, action != glfw.RELEASE):
            return
        if action == glfw.RELEASE:
            return
        if glfw.KEY_KP_0 <= code <= glfw.KEY_KP_9:
            code += glfw.KEY_0 - glfw.KEY_KP_0
        named = {
            glfw.KEY_ESCAPE: "ESCAPE",
            glfw.KEY_TAB: "TAB",
            glfw.KEY_SPACE: "SPACE",
            glfw.KEY_LEFT: "LEFT",
            glfw.KEY_RIGHT: "RIGHT",
            glfw.KEY_UP: "UP",
            glfw.KEY_DOWN: "DOWN",
            glfw.KEY_EQUAL: "+",
            glfw.KEY_KP_ADD: "+",
            glfw.KEY_MINUS: "-",
            glfw.KEY_KP_SUBTRACT: "-",
        }
        name = named.get(code) or (chr(code) if glfw.KEY_0 <= code <= glfw.KEY_Z else "")
        if name and (action == glfw.PRESS or name in (*TURNS, "+", "-")):
            self.key(name)

    def _on_drop(self, _window: Any, paths: list[str]) -> None:
        drop(self.desk, [Path(path) for path in paths])

    def _on_char(self, _window: Any, code: int) -> None:
        if self.gui is not None:
            self.gui.typed(code)


def _refresh_rate() -> int:
    """Pictures per second of the display."""
    import glfw

    monitor = glfw.get_primary_monitor()
    return (glfw.get_video_mode(monitor).refresh_rate if monitor else 0) or RATE
