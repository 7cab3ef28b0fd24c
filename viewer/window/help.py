"""The keys over the picture, and what the windows of the panel have in common."""

from typing import Any

from ..state.view import KEYS

FAINT = 0.60, 0.62, 0.66, 1.0


def show_keys(imgui: Any, left: float, size: Any) -> tuple[float, float, float, float]:
    """Draws them in the middle of the picture; returns their place."""
    imgui.set_next_window_pos(((left + size.x) / 2, size.y / 2), imgui.Cond_.always, (0.5, 0.5))
    imgui.begin("keys", None, bare(imgui) | imgui.WindowFlags_.always_auto_resize)
    if imgui.begin_table("keys", 2, imgui.TableFlags_.sizing_fixed_fit):
        for key, what in KEYS:
            imgui.table_next_column()
            imgui.text(key)
            imgui.table_next_column()
            imgui.push_style_color(imgui.Col_.text, FAINT)
            imgui.text(what)
            imgui.pop_style_color()
        imgui.end_table()
    covered = place(imgui)
    imgui.end()
    return covered


def place(imgui: Any) -> tuple[float, float, float, float]:
    """(left, top, right, bottom) of the window that is being made."""
    (x, y), (width, height) = imgui.get_window_pos(), imgui.get_window_size()
    return x, y, x + width, y + height


def bare(imgui: Any) -> int:
    """Flags of a window without decoration."""
    flags = imgui.WindowFlags_
    return int(
        flags.no_title_bar
        | flags.no_resize
        | flags.no_move
        | flags.no_collapse
        | flags.no_saved_settings
        | flags.no_bring_to_front_on_focus
    )
