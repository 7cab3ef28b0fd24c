"""The desktop window of `mplicits view`: hands GLFW's events to the viewer, and shows its picture."""

import time
from pathlib import Path
from typing import Any

import glfw

from ..draw.camera import Camera
from ..draw.context import Context
from ..draw.options import RenderOptions
from ..state.exports import save_picture
from ..state.overlay import MeshSource
from ..state.source import Source
from ..state.view import KEYS, TURNS, View
from ..state.viewer import Viewer
from .drop import drop
from .gui import Gui
from .panel import Panel

GREETING = "h: all keys.  Drop a model, a mesh or a point cloud here to look at it."
KEY_HELP = "\n".join(f"{key}: {effect}" for key, effect in KEYS)
NO_PANEL = "a panel with every setting: pip install 'mplicits[view]'"
"""Printed after the keys if imgui-bundle is not installed."""
LONGEST_WAIT = 1.0
"""Seconds between two checks for Ctrl-C, which does not end GLFW's wait."""
DEFAULT_RATE = 60
"""Frames per second of a display that does not report its rate."""
NAMED_KEYS = {
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
"""GLFW's key code -> name; the others are named by their character."""


class Window:
    """A visible GLFW window with a Viewer, and with a Panel if it has a GUI."""

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
        """Compile the shader of `source`, and listen to the window's events.

        context, gui: of the window (`greeted`); the caller keeps them. camera, options: of the first picture. storage,
        watch, mesh: see Viewer. Raises UserError if the options do not fit the model, or OpenGL cannot draw its shader.
        """
        view = View(camera, options, source.shader.levels, source.textured, source.shader.moving)
        options.resolved_levels(view.levels)
        options.check_texture(source.textured)
        self.context, self.handle, self.gui = context, context.handle, gui
        self._pointer = (0.0, 0.0)
        self._title = self._printed = ""
        self.viewer = Viewer(context, source, view, storage=storage, watch=watch, mesh=mesh, wake=glfw.post_empty_event)
        self._panel = None if gui is None else Panel(gui.imgui, self.viewer)
        view.panel = gui is not None and gui.is_wide()
        monitor = glfw.get_primary_monitor()
        self._frame_seconds = 1 / ((glfw.get_video_mode(monitor).refresh_rate if monitor else 0) or DEFAULT_RATE)
        with self.context:
            glfw.swap_interval(1)
        self._listen()
        self._fit()
        if gui is not None:
            self.viewer.say(GREETING)
        else:
            print(f"{KEY_HELP}\n{NO_PANEL}", flush=True)

    @property
    def area(self) -> tuple[int, int, int, int]:
        """The picture beside the panel: (x, y from the bottom, width, height), framebuffer pixels."""
        width, height = (max(1, side) for side in glfw.get_framebuffer_size(self.handle))
        panel = self.gui.panel_width() if self.gui is not None and self.viewer.view.panel else 0
        return panel, 0, width - panel, height

    def loop(self) -> None:
        """Run until the window is closed; sleep while nothing changes."""
        while not glfw.window_should_close(self.handle):
            start = time.perf_counter()
            due = self.step()
            if self.viewer.view.animated and due == 0.0:  # some drivers do not wait for the display
                due = max(0.0, 0.9 * self._frame_seconds - (time.perf_counter() - start))
            try:
                if due == 0.0:
                    glfw.poll_events()
                else:
                    glfw.wait_events_timeout(LONGEST_WAIT if due is None else min(due, LONGEST_WAIT))
            except UnicodeDecodeError:
                self.viewer.say("a file whose name is not UTF-8; rename it")

    def step(self) -> float | None:
        """Do one turn of the loop; return the seconds until the next, None if only an event makes one due."""
        due = self.viewer.tick(self.area[2:])
        needs_frames = self.gui is not None and self.gui.needs_frames
        if self.viewer.stale or needs_frames:
            self.paint()
        self._show_texts()
        return 0.0 if self.gui is not None and self.gui.needs_frames else due

    def paint(self, swap: bool = True) -> None:
        """Draw the picture and the panel. swap: show them to the user."""
        self.viewer.stale = False
        with self.context as gl:
            if self.gui is not None and self._panel is not None:
                self.gui.build(self._panel.draw, self.area[2:])
            x, y, width, height = self.area
            gl.screen.use()
            self.viewer.drawing.picture.show((x, y), (width, height), self.viewer.view.split is not None)
            if self.gui is not None:
                self.gui.draw()
            if swap:
                glfw.swap_buffers(self.handle)

    def close(self) -> None:
        self.viewer.close()

    def key(self, name: str) -> None:
        """Handle a key: ESCAPE, S or a key of View.key."""
        view = self.viewer.view
        if name == "ESCAPE" and view.help and self.gui is not None:
            view.help = False
        elif name == "ESCAPE":
            glfw.set_window_should_close(self.handle, True)
        elif name == "S":
            save_picture(self.viewer, self.area[2:])
        else:
            view.key(name)
            if name == "M" and self.viewer.overlay is None:
                self.viewer.say("no mesh lies over the model: drop one here, or start with --mesh FILE")
            if name == "TAB":
                self._fit()
            if name == "H" and self.gui is None:
                print(KEY_HELP, flush=True)
        self.viewer.stale = True

    def _fit(self) -> None:
        """Adapt the view to the picture's size."""
        self.viewer.view.resize(self.area[2:])

    def _show_texts(self) -> None:
        """Set the window's title and, if there is no panel, print messages."""
        viewer = self.viewer
        title = "   ".join(part for part in (viewer.source.name, viewer.drawing.timing, viewer.work.progress) if part)
        if title != self._title:
            self._title = title
            glfw.set_window_title(self.handle, title)
        if self.gui is None and viewer.message != self._printed:
            self._printed = viewer.message
            print(*[line for line in (viewer.message, *viewer.log) if line], sep="\n", flush=True)

    def _listen(self) -> None:
        """Register the callbacks of GLFW."""

        def on_resize(*_: Any) -> None:
            if self.gui is not None:
                if self.gui.is_narrow():
                    self.viewer.view.panel = False
                self.gui.redraw()
            self._fit()

        def on_refresh(*_: Any) -> None:  # some systems call nothing else while the user resizes the window
            self.viewer.stale = True
            self.step()

        glfw.set_cursor_pos_callback(self.handle, self._on_cursor)
        glfw.set_mouse_button_callback(self.handle, self._on_button)
        glfw.set_scroll_callback(self.handle, self._on_scroll)
        glfw.set_key_callback(self.handle, self._on_key)
        glfw.set_char_callback(self.handle, self._on_char)
        listen_drop: Any = glfw.set_drop_callback  # its annotation does not match its call of the callback
        listen_drop(self.handle, self._on_drop)
        glfw.set_window_refresh_callback(self.handle, on_refresh)
        glfw.set_framebuffer_size_callback(self.handle, on_resize)
        glfw.set_window_content_scale_callback(self.handle, on_resize)

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        height = max(1, glfw.get_window_size(window)[1])
        right, up = (x - self._pointer[0]) / height, (self._pointer[1] - y) / height
        self._pointer = (x, y)
        if self.gui is not None and self.gui.on_pointer(x, y):
            return

        def is_down(*buttons: int) -> bool:
            return any(glfw.get_mouse_button(window, button) == glfw.PRESS for button in buttons)

        shift = glfw.PRESS in (glfw.get_key(window, key) for key in (glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT))
        left = is_down(glfw.MOUSE_BUTTON_LEFT)
        if is_down(glfw.MOUSE_BUTTON_RIGHT, glfw.MOUSE_BUTTON_MIDDLE) or (left and shift):
            self.viewer.view.pan(right, up)
        elif left:
            self.viewer.view.turn(right, up)

    def _on_button(self, _window: Any, button: int, action: int, _mods: int) -> None:
        if self.gui is not None:
            self.gui.on_button(button, action == glfw.PRESS)

    def _on_scroll(self, _window: Any, x: float, y: float) -> None:
        if self.gui is None or not self.gui.on_wheel(x, y):
            self.viewer.view.zoom(y)

    def _on_key(self, _window: Any, code: int, _scan: int, action: int, _mods: int) -> None:
        for_panel = self.gui is not None and self.gui.on_key(code, action != glfw.RELEASE)
        if for_panel or action == glfw.RELEASE:
            return
        if glfw.KEY_KP_0 <= code <= glfw.KEY_KP_9:
            code += glfw.KEY_0 - glfw.KEY_KP_0
        name = NAMED_KEYS.get(code) or (chr(code) if glfw.KEY_0 <= code <= glfw.KEY_Z else "")
        if name and (action == glfw.PRESS or name in (*TURNS, "+", "-")):
            self.key(name)

    def _on_drop(self, _window: Any, paths: list[str]) -> None:
        drop(self.viewer, [Path(path) for path in paths])

    def _on_char(self, _window: Any, code: int) -> None:
        if self.gui is not None:
            self.gui.on_character(code)
