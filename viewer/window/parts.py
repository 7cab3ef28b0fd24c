"""What ImGui's windows have in common, those of the panel and those over the picture."""

from typing import Any

WIDTH = 300
"""Of the panel, in window coordinates before the display's scale."""
FAINT = 0.60, 0.62, 0.66, 1.0
"""RGBA of text that matters less."""
TIP_WIDTH = 22
"""Of an explanation, in heights of the font."""

Place = tuple[float, float, float, float]
"""Of an ImGui window: (left, top, right, bottom), window coordinates."""


def show_line(imgui: Any, line: str) -> None:
    """Draw a line of text in the middle of the window."""
    size = imgui.get_io().display_size
    imgui.set_next_window_pos((size.x / 2, size.y / 2), imgui.Cond_.always, (0.5, 0.5))
    imgui.begin("line", None, bare(imgui) | imgui.WindowFlags_.always_auto_resize)
    imgui.text_unformatted(line)
    imgui.end()


def tip(imgui: Any, text: str) -> None:
    """Explain the control that was made last to a pointer that rests on it."""
    if imgui.begin_item_tooltip():
        imgui.push_text_wrap_pos(TIP_WIDTH * imgui.get_font_size())
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def place(imgui: Any) -> Place:
    """Return the place of the ImGui window that is being made."""
    (x, y), (width, height) = imgui.get_window_pos(), imgui.get_window_size()
    return x, y, x + width, y + height


def bare(imgui: Any) -> int:
    """Return the flags of an ImGui window without decoration."""
    flags = imgui.WindowFlags_
    return int(
        flags.no_title_bar
        | flags.no_resize
        | flags.no_move
        | flags.no_collapse
        | flags.no_saved_settings
        | flags.no_bring_to_front_on_focus
    )
