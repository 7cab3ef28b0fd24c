"""The help on the keys, over the picture."""

from typing import Any

from ..state.view import KEYS
from .parts import FAINT, Place, bare, place


def show_keys(imgui: Any, left: float, size: Any) -> Place:
    """Draw the help on the keys in the middle of the picture, and return its place.

    left: where the picture begins, and size: of the window; window coordinates.
    """
    imgui.set_next_window_pos(((left + size.x) / 2, size.y / 2), imgui.Cond_.always, (0.5, 0.5))
    imgui.begin("keys", None, bare(imgui) | imgui.WindowFlags_.always_auto_resize)
    if imgui.begin_table("keys", 2, imgui.TableFlags_.sizing_fixed_fit):
        for key, effect in KEYS:
            imgui.table_next_column()
            imgui.text(key)
            imgui.table_next_column()
            imgui.push_style_color(imgui.Col_.text, FAINT)
            imgui.text(effect)
            imgui.pop_style_color()
        imgui.end_table()
    covered = place(imgui)
    imgui.end()
    return covered
