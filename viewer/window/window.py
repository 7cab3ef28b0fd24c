"""The desktop window of `mplicits view`: passes GLFW's events to the desk and puts its picture on the screen."""

import time
from pathlib import Path
from typing import Any

from ..draw.camera import Camera
from ..draw.context import Context
from ..draw.options import RenderOptions
from ..state.desk import Desk
from ..state.exports import save_picture
from ..state.overlay import MeshSource
from ..state.source import Source
from ..state.view import TURNS, View, keys
from .drop import drop
from .gui import Gui
from .panel import Panel

GREETING = "h: all keys.  Drop a model, a mesh or a point cloud here to look at it."
"""What a window with a panel says when its first picture comes."""
NO_PANEL = "a panel with every setting: pip install 'mplicits[view]'"
"""What is printed, after the keys, where there is none."""
LONGEST_WAIT = 1.0
"""Seconds between two looks at Ctrl-C, which GLFW's wait does not notice."""
DEFAULT_RATE = 60
"""Pictures per second of a display that does not tell its rate."""


class Window:
    """A visible GLFW window with a desk, and with a panel if it has a GUI."""

    def __init__(
        self,
        context: Context,
        gui: Gui | None,
        source: Source,
        camera: Camera,
        options: RenderOptions,
        *,
        storage: str = "auto",
        watch: bool = False,
        mesh: MeshSource | None = None,
    ) -> None:
        """Compile the shader, and listen to the events of a window.

        context, gui: of the window (`greeted`); they stay the caller's. source: what is shown. camera, options: how, at
        first. storage: how shaders hold the weights. watch: load the file again when it changes. mesh: laid over the
        model. Raises UserError if the model does not fit the options, or if its shader cannot be drawn here.
        """
        import glfw

        view = View(camera, options, source.shader.levels, source.textured, source.shader.moving)
        options.resolved_levels(view.levels)
        options.check_texture(source.textured)
        self.context, self.handle, self.gui = context, context.handle, gui
        self._panel = Panel()
        self._pointer = (0.0, 0.0)
        self._title = ""
        self._printed = ""
        """The message that was printed last, where there is no panel."""
        self.desk = Desk(context, source, view, storage=storage, watch=watch, mesh=mesh, wake=glfw.post_empty_event)
        view.panel = self.gui is not None and self.gui.roomy()
        self._frame_seconds = 1 / _refresh_rate()
        with self.context:
            glfw.swap_interval(1)
        self._listen()
        self._fit()
        if self.gui is not None:
            self.desk.say(GREETING)
        else:
            print(f"{keys()}\n{NO_PANEL}", flush=True)

    @property
    def area(self) -> tuple[int, int, int, int]:
        """(x, y from the bottom, width, height) of the picture in framebuffer pixels: what the panel leaves free."""
        import glfw

        width, height = (max(1, side) for side in glfw.get_framebuffer_size(self.handle))
        panel = self.gui.panel_width() if self.gui is not None and self.desk.shown.view.panel else 0
        return panel, 0, width - panel, height

    def loop(self) -> None:
        """Run until the window is closed; sleep while nothing happens, and draw only what has changed."""
        import glfw

        while not glfw.window_should_close(self.handle):
            start = time.perf_counter()
            due = self.step()
            if self.desk.shown.view.animated and due == 0.0:  # Some drivers do not wait for the display.
                due = max(0.0, 0.9 * self._frame_seconds - (time.perf_counter() - start))
            try:
                if due == 0.0:
                    glfw.poll_events()
                else:
                    glfw.wait_events_timeout(LONGEST_WAIT if due is None else min(due, LONGEST_WAIT))
            except UnicodeDecodeError:
                self.desk.say("a file whose name is not UTF-8; rename it")

    def step(self) -> float | None:
        """Do one turn of the loop; return the seconds until the next is due, None if only an event makes one due."""
        due = self.desk.tick(self.area[2:])
        if self.desk.stale or (self.gui is not None and self.gui.restless):
            self.paint()
        self._tell()
        return 0.0 if self.gui is not None and self.gui.restless else due

    def paint(self, swap: bool = True) -> None:
        """Put the picture as far as it is drawn, and the panel, onto the screen. swap: show them to the user."""
        import glfw

        self.desk.stale = False
        with self.context as gl:
            if self.gui is not None:
                self.gui.build(self._panel, self.desk, self.area[2:])
            x, y, width, height = self.area
            gl.screen.use()
            self.desk.drawing.picture.show((x, y), (width, height), self.desk.shown.view.split is not None)
            if self.gui is not None:
                self.gui.draw()
            if swap:
                glfw.swap_buffers(self.handle)

    def close(self) -> None:
        self.desk.close()

    def key(self, name: str) -> None:
        """Do what a key does, given its name: ESCAPE, S or one of View.key."""
        import glfw

        view = self.desk.shown.view
        if name == "ESCAPE" and view.help and self.gui is not None:
            view.help = False
        elif name == "ESCAPE":
            glfw.set_window_should_close(self.handle, True)
        elif name == "S":
            save_picture(self.desk, self.area[2:])
        else:
            view.key(name)
            if name == "M" and self.desk.shown.overlay is None:
                self.desk.say("no mesh lies over the model: drop one here, or start with --mesh FILE")
            if name == "TAB":
                self._fit()
            if name == "H" and self.gui is None:
                print(keys(), flush=True)
        self.desk.stale = True

    def _fit(self) -> None:
        """Adapt the view to the picture's size."""
        self.desk.shown.view.resize(self.area[2:])

    def _tell(self) -> None:
        """Set the window's title and, where there is no panel, print messages on the terminal."""
        import glfw

        desk = self.desk
        title = "   ".join(part for part in (desk.shown.source.name, desk.drawing.timing, desk.work.progress) if part)
        if title != self._title:
            self._title = title
            glfw.set_window_title(self.handle, title)
        if self.gui is None and desk.message != self._printed:
            self._printed = desk.message
            print(*[line for line in (desk.message, *desk.log) if line], sep="\n", flush=True)

    def _listen(self) -> None:
        """Let GLFW call this window when something happens."""
        import glfw

        def resized(*_: Any) -> None:
            if self.gui is not None and self.gui.narrow():
                self.desk.shown.view.panel = False
            self._fit()
            self._wake()

        def refreshed(*_: Any) -> None:  # Some systems call nothing else while a window is being resized.
            self.desk.stale = True
            self.step()

        glfw.set_cursor_pos_callback(self.handle, self._on_cursor)
        glfw.set_mouse_button_callback(self.handle, self._on_button)
        glfw.set_scroll_callback(self.handle, self._on_scroll)
        glfw.set_key_callback(self.handle, self._on_key)
        glfw.set_char_callback(self.handle, self._on_char)
        listen_drop: Any = glfw.set_drop_callback  # It is annotated as GLFW calls it, not as it calls back.
        listen_drop(self.handle, self._on_drop)
        glfw.set_window_refresh_callback(self.handle, refreshed)
        glfw.set_framebuffer_size_callback(self.handle, resized)
        glfw.set_window_content_scale_callback(self.handle, resized)

    def _wake(self) -> None:
        """Let the panel be drawn again."""
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
            self.desk.shown.view.pan(right, up)
        elif held[0]:
            self.desk.shown.view.turn(right, up)

    def _on_button(self, _window: Any, button: int, action: int, _mods: int) -> None:
        import glfw

        if self.gui is not None:
            self.gui.pressed(button, action == glfw.PRESS)

    def _on_scroll(self, _window: Any, x: float, y: float) -> None:
        if self.gui is None or not self.gui.scrolled(x, y):
            self.desk.shown.view.zoom(y)

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
    """Return how many pictures per second the display shows."""
    import glfw

    monitor = glfw.get_primary_monitor()
    return (glfw.get_video_mode(monitor).refresh_rate if monitor else 0) or DEFAULT_RATE
