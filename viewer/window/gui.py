"""Dear ImGui over the window's picture: its setup, its input and its look. What it shows is in panel.py."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import glfw

from ..draw.context import Context
from .parts import WIDTH, Place, show_line

if TYPE_CHECKING:  # They import all that draws a model, and a window says what it waits for before that.
    from ..state.desk import Desk
    from .panel import Panel

SETTLING_FRAMES = 3
"""Frames that ImGui takes until it shows what an event did."""
NARROW = 500
"""Width of a window, in window coordinates before the display's scale, below which the panel folds."""
FONT_SIZE = 15.0
"""In window coordinates, before the display's scale."""
CONTROLS = glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL
SHIFTS = glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT
"""Each is asked for whether it is held, because an event on X11 comes with the modifiers from before it."""
ACCENT, DARK, FRAME, TEXT = (0.36, 0.56, 0.86), (0.105, 0.11, 0.125), (0.19, 0.20, 0.225), (0.88, 0.89, 0.91)
"""RGB of the panel's parts."""


def open_gui(context: Context) -> "Gui | None":
    """Return the GUI of a window's context, or None if imgui-bundle, of the extra `view`, is not installed."""
    try:
        return Gui(context)
    except ImportError:
        return None


class Gui:
    """The panel of a window, which passes its events on: each method for one returns whether it was for the panel."""

    def __init__(self, context: Context) -> None:
        """Begin in the context of a window. Raises ImportError if imgui-bundle is not installed."""
        import imgui_bundle
        from imgui_bundle import imgui

        self._context, self._imgui = context, imgui
        self._window: Any = context.handle
        self._keys = _keys(imgui)
        self._frames_left = SETTLING_FRAMES
        self._owned = False
        """Whether the mouse button that is held went down on the panel."""
        self._popup = False
        """Whether a list of choices is open, to which every click belongs."""
        self._covered: list[Place] = []
        """What the panel and its like cover."""
        self._pointer = (-1.0, -1.0)
        self._last = time.perf_counter()
        self._gui = imgui.create_context()
        imgui.get_io().set_ini_filename("")
        font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
        if font.exists():
            imgui.get_io().fonts.add_font_from_file_ttf(str(font), FONT_SIZE)
        self._scale = 1.0
        _dress(imgui)
        with context:
            imgui.backends.opengl3_init("#version 330")

    @property
    def restless(self) -> bool:
        """Whether more frames are due until everything is seen that has happened."""
        return self._frames_left > 0

    def stir(self) -> None:
        """Draw some frames more, because something has happened that the panel may show."""
        self._frames_left = SETTLING_FRAMES

    def panel_width(self) -> int:
        """Return how many framebuffer pixels an open panel takes from the picture.

        In a narrow window it takes none and lies over the picture.
        """
        return round(WIDTH * self._ui_scale() * self._ratio()) if self.roomy() else 0

    def narrow(self) -> bool:
        """Return whether an open panel would hide most of the picture."""
        return bool(glfw.get_window_size(self._window)[0] < NARROW * self._ui_scale())

    def roomy(self) -> bool:
        """Return whether the window is wide enough for a panel beside the picture."""
        return bool(glfw.get_window_size(self._window)[0] >= 2 * WIDTH * self._ui_scale())

    def build(self, panel: "Panel", desk: "Desk", area: tuple[int, int]) -> None:
        """Make the next frame, and let the desk do what the user has asked for; the context must be current.

        area: (width, height) of the picture on the screen, in framebuffer pixels.
        """
        imgui, scale = self._imgui, self._begin()
        self._covered = panel.draw(imgui, desk, area, scale)
        self._popup = imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
        imgui.render()
        self._frames_left = max(0, self._frames_left - 1)

    def build_notice(self, line: str) -> None:
        """Make a frame that shows a line of text in the middle of the window; the context must be current."""
        for _ in range(2):  # In the first, ImGui measures the line and hides it.
            self._begin()
            show_line(self._imgui, line)
            self._imgui.render()

    def _begin(self) -> float:
        """Begin a frame of the window's present size. Returns the panel's scale."""
        imgui = self._imgui
        io = imgui.get_io()
        now = time.perf_counter()
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
        self._imgui.backends.opengl3_render_draw_data(self._imgui.get_draw_data())

    def moved(self, x: float, y: float) -> bool:
        """The pointer has moved to (x, y), window coordinates."""
        before, self._pointer = self._over(), (x, y)
        self._imgui.get_io().add_mouse_pos_event(x, y)
        held = any(glfw.get_mouse_button(self._window, button) for button in range(3))
        if self._owned or (not held and (before or self._over())):
            self.stir()
        return self._owned if held else self._over()

    def pressed(self, button: int, down: bool) -> bool:
        """A mouse button has gone down or up."""
        if button < 3:
            self._imgui.get_io().add_mouse_button_event(button, down)
        self._owned = (
            self._over()
            if down
            else self._owned and any(glfw.get_mouse_button(self._window, other) for other in range(3))
        )
        self.stir()
        return self._owned

    def scrolled(self, x: float, y: float) -> bool:
        """The wheel has been turned by so many notches, sideways and up."""
        over = self._over()
        if over:
            self._imgui.get_io().add_mouse_wheel_event(x, y)
            self.stir()
        return over

    def key(self, code: int, down: bool) -> bool:
        """A key, given by GLFW's code, has gone down or up."""
        imgui = self._imgui
        io = imgui.get_io()
        for keys, modifier in ((CONTROLS, imgui.Key.mod_ctrl), (SHIFTS, imgui.Key.mod_shift)):
            io.add_key_event(modifier, any(glfw.get_key(self._window, key) == glfw.PRESS for key in keys))
        if code in self._keys:
            io.add_key_event(self._keys[code], down)
        self.stir()
        return bool(io.want_text_input)

    def typed(self, code: int) -> None:
        """A character, given by its Unicode code point, has been typed."""
        self._imgui.get_io().add_input_character(code)

    def release(self) -> None:
        with self._context:
            self._imgui.backends.opengl3_shutdown()
        self._imgui.destroy_context(self._gui)

    def _over(self) -> bool:
        """Return whether the pointer is on something that the panel drew last."""
        x, y = self._pointer
        covered = (left <= x < right and top <= y < bottom for left, top, right, bottom in self._covered)
        return self._popup or any(covered)

    def _ratio(self) -> float:
        """Return how many framebuffer pixels make one window coordinate."""
        width = glfw.get_window_size(self._window)[0]
        return float(glfw.get_framebuffer_size(self._window)[0] / width) if width else 1.0

    def _ui_scale(self) -> float:
        """Return the panel's scale in window coordinates: the display's, less what the system scales itself."""
        return max(1.0, float(glfw.get_window_content_scale(self._window)[0]) / max(1e-3, self._ratio()))


def _keys(imgui: Any) -> dict[int, Any]:
    """Return the keys that editing a number needs: GLFW's code and ImGui's."""
    key = imgui.Key
    return {
        glfw.KEY_TAB: key.tab,
        glfw.KEY_LEFT: key.left_arrow,
        glfw.KEY_RIGHT: key.right_arrow,
        glfw.KEY_HOME: key.home,
        glfw.KEY_END: key.end,
        glfw.KEY_DELETE: key.delete,
        glfw.KEY_BACKSPACE: key.backspace,
        glfw.KEY_ENTER: key.enter,
        glfw.KEY_KP_ENTER: key.keypad_enter,
        glfw.KEY_ESCAPE: key.escape,
        glfw.KEY_A: key.a,
        glfw.KEY_C: key.c,
        glfw.KEY_V: key.v,
        glfw.KEY_X: key.x,
    }


def _dress(imgui: Any) -> None:
    """Set quiet colours and rounded corners."""
    imgui.style_colors_dark()
    style, col = imgui.get_style(), imgui.Col_
    style.window_padding, style.frame_padding = imgui.ImVec2(14, 12), imgui.ImVec2(8, 4)
    style.item_spacing, style.item_inner_spacing = imgui.ImVec2(8, 7), imgui.ImVec2(8, 4)
    style.frame_rounding = style.grab_rounding = style.popup_rounding = 4.0
    style.window_rounding, style.window_border_size, style.scrollbar_size, style.grab_min_size = 0.0, 0.0, 10.0, 12.0
    hovered = tuple(0.75 * f + 0.25 * a for f, a in zip(FRAME, ACCENT, strict=True))
    for colour, names in (
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
            style.set_color_(name, imgui.ImVec4(*colour))
