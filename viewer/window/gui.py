"""Dear ImGui over the window's picture: set-up, input and style. panel.py has the content."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import glfw

from ..draw.context import Context

WIDTH = 300
"""Of the panel, in window coordinates at scale 1."""
NARROW = 500
"""In a window narrower than this, in window coordinates at scale 1, the panel folds."""
FONT_SIZE = 15.0
"""In window coordinates at scale 1."""
SETTLING_FRAMES = 3
"""Number of frames until ImGui shows the effect of an event."""
BUTTONS = range(3)
"""The mouse buttons that ImGui knows."""
ACCENT, DARK, FRAME, TEXT = (0.36, 0.56, 0.86), (0.105, 0.11, 0.125), (0.19, 0.20, 0.225), (0.88, 0.89, 0.91)
"""RGB."""
EDITING_KEYS = {
    glfw.KEY_TAB: "tab",
    glfw.KEY_LEFT: "left_arrow",
    glfw.KEY_RIGHT: "right_arrow",
    glfw.KEY_HOME: "home",
    glfw.KEY_END: "end",
    glfw.KEY_DELETE: "delete",
    glfw.KEY_BACKSPACE: "backspace",
    glfw.KEY_ENTER: "enter",
    glfw.KEY_KP_ENTER: "keypad_enter",
    glfw.KEY_ESCAPE: "escape",
    glfw.KEY_A: "a",
    glfw.KEY_C: "c",
    glfw.KEY_V: "v",
    glfw.KEY_X: "x",
}
"""GLFW's key code -> ImGui's name, of the keys that edit a number."""

Place = tuple[float, float, float, float]
"""Rectangle of an ImGui window: (left, top, right, bottom), window coordinates."""


class Gui:
    """Dear ImGui in a window; the event methods return whether the panel takes the event.

    Raises ImportError if imgui-bundle is not installed.
    """

    def __init__(self, context: Context) -> None:
        import imgui_bundle
        from imgui_bundle import imgui

        self.imgui: Any = imgui
        self._context = context
        self._window: Any = context.handle
        self._frames_left = SETTLING_FRAMES
        self._owned = False
        """Whether the held mouse button went down on the panel."""
        self._popup = False
        """Whether a list of choices is open, which takes every click."""
        self._covered: list[Place] = []
        """Places of the ImGui windows."""
        self._pointer = (-1.0, -1.0)
        self._last = time.perf_counter()
        self._gui = imgui.create_context()
        imgui.get_io().set_ini_filename("")
        font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
        if font.exists():
            imgui.get_io().fonts.add_font_from_file_ttf(str(font), FONT_SIZE)
        self._scale = 1.0
        _set_style(imgui)
        with context:
            imgui.backends.opengl3_init("#version 330")

    @property
    def needs_frames(self) -> bool:
        """Whether more frames are due until the last event has its full effect."""
        return self._frames_left > 0

    def redraw(self) -> None:
        """Draw some more frames."""
        self._frames_left = SETTLING_FRAMES

    def panel_width(self) -> int:
        """Return the width of an open panel beside the picture, framebuffer pixels; 0 if it lies over the picture."""
        return round(WIDTH * self._ui_scale() * self._ratio()) if self.is_wide() else 0

    def is_narrow(self) -> bool:
        """Return whether an open panel would hide most of the picture."""
        return bool(glfw.get_window_size(self._window)[0] < NARROW * self._ui_scale())

    def is_wide(self) -> bool:
        """Return whether the window has room for a panel beside the picture."""
        return bool(glfw.get_window_size(self._window)[0] >= 2 * WIDTH * self._ui_scale())

    def build(self, draw: Callable[[tuple[int, int], float], list[Place]], area: tuple[int, int]) -> None:
        """Make the next frame, and apply the user's input; the context must be current.

        draw: `Panel.draw`. area: (width, height) of the picture, framebuffer pixels.
        """
        self._covered = draw(area, self._begin())
        self._popup = self.imgui.is_popup_open("", self.imgui.PopupFlags_.any_popup)
        self.imgui.render()
        self._frames_left = max(0, self._frames_left - 1)

    def build_notice(self, line: str) -> None:
        """Make a frame with a line of text in the middle of the window; the context must be current."""
        for _ in range(2):  # in the first, ImGui measures the line and hides it
            self._begin()
            size = self.imgui.get_io().display_size
            begin_bare(self.imgui, "line", (size.x / 2, size.y / 2), (0.5, 0.5))
            self.imgui.text_unformatted(line)
            self.imgui.end()
            self.imgui.render()

    def _begin(self) -> float:
        """Begin a frame of the window's current size, and return the panel's scale."""
        imgui, io, now = self.imgui, self.imgui.get_io(), time.perf_counter()
        io.delta_time, self._last = max(1e-4, now - self._last), now
        width, height = glfw.get_window_size(self._window)
        io.display_size = imgui.ImVec2(max(1, width), max(1, height))
        io.display_framebuffer_scale = imgui.ImVec2(self._ratio(), self._ratio())
        if (scale := self._ui_scale()) != self._scale:
            imgui.get_style().scale_all_sizes(scale / self._scale)
            imgui.get_style().font_scale_dpi = scale
            self._scale = scale
        imgui.backends.opengl3_new_frame()
        imgui.new_frame()
        return scale

    def draw(self) -> None:
        """Draw the frame onto the screen; the context must be current."""
        self.imgui.backends.opengl3_render_draw_data(self.imgui.get_draw_data())

    def on_pointer(self, x: float, y: float) -> bool:
        """Handle a move of the pointer to (x, y), window coordinates."""
        before, self._pointer = self._over(), (x, y)
        self.imgui.get_io().add_mouse_pos_event(x, y)
        held = self._is_held()
        if self._owned or (not held and (before or self._over())):
            self.redraw()
        return self._owned if held else self._over()

    def on_button(self, button: int, down: bool) -> bool:
        """Handle a press or release of a mouse button."""
        if button in BUTTONS:
            self.imgui.get_io().add_mouse_button_event(button, down)
        self._owned = self._over() if down else self._owned and self._is_held()
        self.redraw()
        return self._owned

    def on_wheel(self, x: float, y: float) -> bool:
        """Handle notches of the wheel, sideways and up."""
        over = self._over()
        if over:
            self.imgui.get_io().add_mouse_wheel_event(x, y)
            self.redraw()
        return over

    def on_key(self, code: int, down: bool) -> bool:
        """Handle a press or release of a key, GLFW's code."""
        imgui, io = self.imgui, self.imgui.get_io()
        # The modifiers come from GLFW: on X11, an event has those from before it.
        for keys, modifier in (
            ((glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL), imgui.Key.mod_ctrl),
            ((glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT), imgui.Key.mod_shift),
        ):
            io.add_key_event(modifier, any(glfw.get_key(self._window, key) == glfw.PRESS for key in keys))
        if code in EDITING_KEYS:
            io.add_key_event(getattr(imgui.Key, EDITING_KEYS[code]), down)
        self.redraw()
        return bool(io.want_text_input)

    def on_character(self, code: int) -> None:
        """Handle a typed character, a Unicode code point."""
        self.imgui.get_io().add_input_character(code)

    def release(self) -> None:
        with self._context:
            self.imgui.backends.opengl3_shutdown()
        self.imgui.destroy_context(self._gui)

    def _is_held(self) -> bool:
        return any(glfw.get_mouse_button(self._window, button) for button in BUTTONS)

    def _over(self) -> bool:
        """Return whether the pointer is over an ImGui window."""
        x, y = self._pointer
        covered = (left <= x < right and top <= y < bottom for left, top, right, bottom in self._covered)
        return self._popup or any(covered)

    def _ratio(self) -> float:
        """Return the number of framebuffer pixels per window coordinate."""
        width = glfw.get_window_size(self._window)[0]
        return float(glfw.get_framebuffer_size(self._window)[0] / width) if width else 1.0

    def _ui_scale(self) -> float:
        """Return the panel's scale in window coordinates: the display's, unless the system scales itself."""
        return max(1.0, float(glfw.get_window_content_scale(self._window)[0]) / max(1e-3, self._ratio()))


def begin_bare(imgui: Any, name: str, position: tuple[float, float], pivot: tuple[float, float]) -> None:
    """Begin an ImGui window that fits its content, undecorated. pivot: its point at `position`, in [0, 1]^2."""
    imgui.set_next_window_pos(position, imgui.Cond_.always, pivot)
    imgui.begin(name, None, bare_flags(imgui) | imgui.WindowFlags_.always_auto_resize)


def bare_flags(imgui: Any) -> int:
    """Return the flags of an ImGui window without decoration."""
    names = "no_title_bar no_resize no_move no_collapse no_saved_settings no_bring_to_front_on_focus"
    return sum(int(getattr(imgui.WindowFlags_, name)) for name in names.split())


def _set_style(imgui: Any) -> None:
    imgui.style_colors_dark()
    style, col = imgui.get_style(), imgui.Col_
    style.window_padding, style.frame_padding = imgui.ImVec2(14, 12), imgui.ImVec2(8, 4)
    style.item_spacing, style.item_inner_spacing = imgui.ImVec2(8, 7), imgui.ImVec2(8, 4)
    style.frame_rounding = style.grab_rounding = style.popup_rounding = 4.0
    style.window_rounding, style.window_border_size, style.scrollbar_size, style.grab_min_size = 0.0, 0.0, 10.0, 12.0
    hovered = tuple(0.75 * f + 0.25 * a for f, a in zip(FRAME, ACCENT, strict=True))
    for color, names in (
        ((*DARK, 0.97), (col.window_bg, col.popup_bg)),
        ((*FRAME, 1.0), (col.frame_bg, col.button, col.header)),
        ((*hovered, 1.0), (col.frame_bg_hovered, col.button_hovered, col.header_hovered)),
        ((*ACCENT, 0.8), (col.frame_bg_active, col.button_active, col.header_active)),
        ((*ACCENT, 1.0), (col.slider_grab, col.slider_grab_active, col.check_mark, col.plot_histogram)),
        ((*TEXT, 1.0), (col.text,)),
        ((*FRAME, 1.0), (col.separator, col.border)),
        ((0.0, 0.0, 0.0, 0.0), (col.scrollbar_bg,)),
    ):
        for name in names:
            style.set_color_(name, imgui.ImVec4(*color))
